// What the reader points at, in words with units, and a ring around the reading and around the model.

/** The values of one reading: pairs of a name and a text. */
function valuesOf(state, k) {
  const { data, values, group } = state, { unit, decimals } = group, pairs = [];
  const finite = list => list && Number.isFinite(list[k]);
  if (finite(data.contraction)) pairs.push(["contraction", data.contraction[k].toFixed(4)]);
  if (finite(data.pressure)) pairs.push(["pressure", `${data.pressure[k].toFixed(1)} ${data.pressure_unit}`]);
  if (group.along === "time" && finite(data.time)) pairs.push(["time", `${data.time[k].toFixed(3)} s`]);
  const difference = values[k] - data.measured[k];
  pairs.push([`${group.measured} measured`, `${data.measured[k].toFixed(decimals)} ${unit}`]);
  pairs.push([`${group.measured} of the model`, `${values[k].toFixed(decimals)} ${unit}`]);
  pairs.push(["difference", `${signed(difference, decimals)} ${unit}`]);
  return pairs;
}

function signed(value, decimals) {
  const text = Math.abs(value).toFixed(decimals);
  return `${Number(text) === 0 ? "" : value < 0 ? "\u2212" : "+"}${text}`;
}

/** Show the reading, else the picked cell, else how to begin. */
function showReadout(figure, state, loud = false) {
  const place = figure.querySelector(".readout"), { data, hovered } = state;
  place.setAttribute("aria-live", loud ? "polite" : "off"); // a pointer that moves would never let it finish
  place.replaceChildren();
  const branch = ["elongating", "", "contracting"];
  if (hovered >= 0) {
    const run = data.runs[data.run[hovered]], way = branch[data.branch[hovered]];
    const still = run.few || !way || state.group.along !== "contraction";
    place.append(named("name", `${run.label}${still ? "" : `, ${way}`} (line ${data.row[hovered]} of its file)`));
    for (const [name, value] of valuesOf(state, hovered)) place.append(valued(name, value));
  } else if (state.picked) {
    place.append(named("name", state.picked.words()));
  } else {
    place.append(named("name", `Point at a reading${data.maps ? ", or at a cell of the map," : ""} to see its values.`));
  }
}

function named(kind, text) {
  const span = document.createElement("span");
  span.className = kind;
  span.textContent = text;
  return span;
}

function valued(name, value) {
  const pair = named("pair-of", `${name} `), bold = document.createElement("b");
  bold.textContent = value;
  pair.append(bold);
  return pair;
}

/** Rings on both panes, where the reading at which the reader points is. */
function showRings(state, pair) {
  pair.forEach((u, lower) => {
    u.rings ??= ["of-reading", "of-model"].map(kind => u.over.appendChild(named(`ring ${kind}`, "")));
    const k = state.hovered, { data, values } = state;
    const heights = k < 0 ? [] : lower ? [values[k] - data.measured[k]] : [data.measured[k], values[k]];
    u.rings.forEach((ring, n) => {
      const left = k < 0 ? NaN : u.valToPos(data.runs[data.run[k]].along[k], "x"), top = u.valToPos(heights[n] ?? NaN, "y");
      ring.hidden = !(left >= 0 && left <= u.over.clientWidth && top >= 0 && top <= u.over.clientHeight);
      if (!ring.hidden) Object.assign(ring.style, { left: `${left}px`, top: `${top}px` });
    });
  });
}

/** The reading that is nearest to a place on a pane, no farther away than a fingertip; -1 if there is none. */
function nearest(state, u, isLower, left, top, farthest = 40) {
  const { data, values } = state;
  let best = farthest * farthest, found = -1;
  const { x, y } = u.scales, across = u.over.clientWidth / (x.max - x.min), up = u.over.clientHeight / (y.max - y.min);
  for (const number of state.shown) {
    const run = data.runs[number];
    for (let k = run.first; k < run.end; k++) {
      const dx = (run.along[k] - x.min) * across - left;
      if (dx * dx >= best) continue;
      const at = value => (y.max - value) * up - top;
      const dy = isLower ? at(values[k] - data.measured[k]) : Math.min(Math.abs(at(data.measured[k])), Math.abs(at(values[k])));
      if (dx * dx + dy * dy < best) { best = dx * dx + dy * dy; found = k; }
    }
  }
  return found;
}
