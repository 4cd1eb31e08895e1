// What the reader points at on the map, and what the map shows of a reading.

/** A cell as the reader's choice: which readings are in it, of which runs, and what is to be said of it. */
function pickOf(data, map, cell, state) {
  const holds = k => data.cell[k] === cell && map.branches.includes(data.branch[k]);
  const runs = new Set();
  let count = 0;
  for (let k = 0; k < data.count; k++) if (holds(k)) { runs.add(data.run[k]); count++; }
  const marked = `Marked: ${count} readings of ${runs.size} ${runs.size === 1 ? "run" : "runs"}.`;
  return { holds, runs, map, cell, words: () => `${cellWords(data, map, cell, map.values[state.model])}. ${marked}` };
}

function cellWords(data, map, cell, values) {
  const { rows, columns, noise } = data.maps, row = rows[Math.floor(cell / columns.length)];
  const value = values[cell], digits = Math.min(Math.max(0, 1 - Math.floor(Math.log10(noise))), 6);
  const misfit = `mean misfit ${signed(value, digits)} N, ${Math.abs(value / noise).toFixed(1)} times the noise`;
  return `${row}, contraction ${columns[cell % columns.length]}, ${map.title}: ${misfit}`;
}

/** Let the reader point at cells, by pointer and by keyboard; `pick(map, cell or -1, kept)` is told. */
function wireMaps(data, maps, pick) {
  const columns = data.maps?.columns.length;
  maps.forEach(({ map, model, mesh, cells }, number) => {
    const known = cells.map((_, k) => Number.isFinite(map.values[model][k]));
    mesh.setAttribute("role", "listbox");
    mesh.setAttribute("tabindex", "0");
    mesh.setAttribute("aria-label", `Cells of the map, ${map.title}. The arrow keys go from cell to cell.`);
    cells.forEach((cell, k) => {
      if (!known[k]) return cell.setAttribute("aria-hidden", "true");
      cell.id = `cell-${number}-${k}`;
      cell.setAttribute("role", "option");
      cell.setAttribute("aria-selected", "false");
      cell.setAttribute("aria-label", cellWords(data, map, k, map.values[model]));
      cell.addEventListener("pointerenter", () => pick(map, k, false));
      cell.addEventListener("pointerleave", () => pick(map, -1, false));
      cell.addEventListener("click", () => pick(map, k, true));
    });
    let at = -1;
    const go = to => { at = to; mesh.setAttribute("aria-activedescendant", `cell-${number}-${at}`); pick(map, at, true); };
    mesh.addEventListener("keydown", event => {
      const step = { ArrowRight: 1, ArrowLeft: -1, ArrowUp: columns, ArrowDown: -columns }[event.key];
      if (event.key === "Escape") { at = -1; mesh.removeAttribute("aria-activedescendant"); return pick(map, -1, true); }
      if (!step) return;
      event.preventDefault();
      if (at < 0) return go(known.indexOf(true));
      for (let to = at + step; to >= 0 && to < known.length; to += step) {
        if (Math.abs(step) === 1 && Math.floor(to / columns) !== Math.floor(at / columns)) return;
        if (known[to]) return go(to);
      }
    });
  });
}

/** Frames on the maps around one cell and around its row; of the cell of a reading, on the maps of its branch. */
function markMaps(data, maps, cell, holds) {
  const columns = data.maps?.columns.length;
  for (const one of maps) {
    const shows = cell >= 0 && cell < one.cells.length && holds(one.map);
    one.marks ??= ["row-mark", "cell-mark"].map(name => {
      const mark = document.createElementNS(SVG, "rect");
      mark.setAttribute("class", name);
      one.mesh.after(mark);
      return mark;
    });
    for (const [k, path] of one.cells.entries()) {
      if (path.hasAttribute("role")) path.setAttribute("aria-selected", String(shows && k === cell));
    }
    const row = shows ? Math.floor(cell / columns) * columns : -1;
    const boxes = shows ? [boxOf(one.cells.slice(row, row + columns)), boxOf([one.cells[cell]])] : [];
    one.marks.forEach((mark, n) => {
      mark.style.display = shows ? "" : "none";
      for (const [name, value] of Object.entries(boxes[n] || {})) mark.setAttribute(name, value);
    });
  }
}

function boxOf(cells) {
  const boxes = cells.map(cell => cell.getBBox());
  const x = Math.min(...boxes.map(b => b.x)), y = Math.min(...boxes.map(b => b.y));
  const right = Math.max(...boxes.map(b => b.x + b.width)), low = Math.max(...boxes.map(b => b.y + b.height));
  return { x, y, width: right - x, height: low - y };
}

/** Cells as the reader points at them, and keeps one by a press. */
function wirePicks(state, maps, refresh) {
  const { data } = state;
  let kept = null;
  wireMaps(data, maps, (map, cell, isPress) => {
    const pick = cell < 0 ? null : pickOf(data, map, cell, state);
    if (isPress) kept = pick && kept?.map === map && kept.cell === cell ? null : pick;
    state.picked = isPress ? kept : pick || kept;
    const [run] = state.picked?.runs || [];
    if (isPress && run !== undefined && !state.shown.some(number => state.picked.runs.has(number))) state.showRun(run);
    refresh(isPress);
  });
}

/** Frames on the map: around the picked cell, else around that of the reading at which one points. */
function showMarks({ data, picked, hovered }, maps) {
  if (picked) markMaps(data, maps, picked.cell, map => map === picked.map);
  else if (hovered >= 0) markMaps(data, maps, data.cell[hovered], map => map.branches.includes(data.branch[hovered]));
  else markMaps(data, maps, -1, () => false);
}
