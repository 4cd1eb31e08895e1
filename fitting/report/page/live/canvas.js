// What is drawn into the panes: readings, models and misfits, on the axes that uPlot keeps.

const PALE = 0.28, ELONGATING = 0;

/** The colours of the page as it is now, light or dark; those of runs are the colours of the key. */
function coloursOf(figure) {
  const probe = document.createElement("i");
  figure.querySelector(".key").append(probe);
  const ranks = [0, 1, 2, 3, 4].map(rank => { probe.className = `h${rank}`; return getComputedStyle(probe).borderTopColor; });
  probe.remove();
  const page = name => getComputedStyle(figure).getPropertyValue(name).trim();
  return { ranks, ink: page("--ink"), soft: page("--soft"), line: page("--line"), grey: "#8c8c8c" };
}

/** Pixels of values on the two scales of a picture. */
function places(u) {
  const x = u.scales.x, y = u.scales.y, { left, top, width, height } = u.bbox;
  const across = width / (x.max - x.min), up = height / (y.max - y.min);
  return [value => left + (value - x.min) * across, value => top + height - (value - y.min) * up];
}

/** Draw within the axes alone, and leave the canvas as uPlot knows it. */
function within(u, draw) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.lineJoin = "round";
  draw(ctx, ...places(u), uPlot.pxRatio);
  ctx.restore();
}

/** Dots at some readings: squares, which a canvas fills many times faster than circles. */
function dots(ctx, atX, atY, size, run, height, wanted = () => true) {
  const half = size / 2;
  for (let k = run.first; k < run.end; k++) {
    if (wanted(k)) ctx.fillRect(atX(run.along[k]) - half, atY(height(k)) - half, size, size);
  }
}

/** The line of a model through the readings of one run; dashed while the muscle elongates. The points of a map lie along
 * the axis with both branches mixed: there a line goes on from each to the next of its branch. */
function modelLine(ctx, atX, atY, px, data, run, values, width, dash) {
  const isShort = run.few && data.groups[run.group].along === "time"; // a motion: one line through both branches
  for (const branch of [0, 1, 2]) {
    ctx.beginPath();
    let before = -2;
    for (let k = run.first; k < run.end; k++) {
      if (data.branch[k] !== branch && !isShort) continue;
      const begins = run.few ? before < 0 : before !== k - 1;
      const turning = !run.few && begins && k > run.first && data.branch[k - 1] !== branch;
      if (begins) ctx.moveTo(atX(run.along[turning ? k - 1 : k]), atY(values[turning ? k - 1 : k]));
      ctx.lineTo(atX(run.along[k]), atY(values[k]));
      before = k;
    }
    ctx.lineWidth = width * px;
    ctx.setLineDash(dash || (branch === ELONGATING && !isShort ? [5 * px, 3 * px] : []));
    ctx.stroke();
    if (isShort) break;
  }
}

/** The lines of the misfit of one run, averaged. */
function misfitLines(ctx, atX, atY, px, data, run, values, width, dash) {
  for (const [branch, along, missed] of courses(data, run, values)) {
    ctx.beginPath();
    along.forEach((x, k) => (k ? ctx.lineTo(atX(x), atY(missed[k])) : ctx.moveTo(atX(x), atY(missed[k]))));
    ctx.lineWidth = width * px;
    ctx.setLineDash(dash || (branch === ELONGATING ? [5 * px, 3 * px] : []));
    ctx.stroke();
  }
}

/** Measured and model, on the upper axes. */
function drawUpper(u, state) {
  const { data, values, colours } = state;
  within(u, (ctx, atX, atY, px) => {
    for (const number of state.shown) {
      const run = data.runs[number];
      ctx.globalAlpha = state.isPale(number) ? PALE : 0.8;
      ctx.fillStyle = colours.grey;
      dots(ctx, atX, atY, (run.few ? 6 : 2.4) * px, run, k => data.measured[k]);
    }
    for (const number of state.shown) {
      ctx.globalAlpha = state.isPale(number) ? PALE : 1;
      ctx.strokeStyle = colours.ranks[data.runs[number].rank];
      modelLine(ctx, atX, atY, px, data, data.runs[number], values, 1.5);
    }
    drawOver(ctx, atX, atY, px, state, modelLine, k => data.measured[k]);
  });
}

/** The misfit over the band of noise, on the lower axes. */
function drawLower(u, state) {
  const { data, values, colours } = state;
  within(u, (ctx, atX, atY, px) => {
    const { left, width } = u.bbox, band = state.group.band;
    ctx.fillStyle = colours.grey;
    ctx.globalAlpha = 0.28;
    ctx.fillRect(left, atY(band), width, Math.max(atY(-band) - atY(band), px));
    ctx.globalAlpha = 1;
    ctx.fillRect(left, atY(0) - px / 2, width, px);
    for (const number of state.shown) {
      const run = data.runs[number];
      ctx.fillStyle = ctx.strokeStyle = colours.ranks[run.rank];
      ctx.globalAlpha = state.isPale(number) ? PALE / 2 : run.few ? 1 : 0.3;
      dots(ctx, atX, atY, (run.few ? 6 : 2) * px, run, k => values[k] - data.measured[k]);
      ctx.globalAlpha = state.isPale(number) ? PALE : 1;
      misfitLines(ctx, atX, atY, px, data, run, values, 1.6);
    }
    drawOver(ctx, atX, atY, px, state, misfitLines, k => values[k] - data.measured[k]);
  });
}

/** What the reader points at: the model of a bar as a dashed line, and the readings of a cell of the map. */
function drawOver(ctx, atX, atY, px, state, line, height) {
  const { data, colours } = state;
  const preview = state.preview === data.models[state.model] ? null : state.preview; // that one is drawn already
  ctx.globalAlpha = 1;
  ctx.strokeStyle = ctx.fillStyle = colours.ink;
  for (const number of state.shown) {
    const run = data.runs[number];
    if (preview) line(ctx, atX, atY, px, data, run, preview.values, 1.1, [2 * px, 2.5 * px]);
    if (state.picked) dots(ctx, atX, atY, (run.few ? 9 : 4) * px, run, height, state.picked.holds);
  }
}
