// The two pairs of axes: what is measured above, the misfit below, enlarged together along what they share.

const ROOM = 1.15, MARGIN = 0.04;

/** Ends of the axes on which the shown runs fit with every model, so that a model that moves stays in sight. */
function spans(state) {
  const { data, shown, group } = state;
  const x = [Infinity, -Infinity], y = [Infinity, -Infinity];
  let reach = group.band;
  const stretch = (ends, value) => { ends[0] = Math.min(ends[0], value); ends[1] = Math.max(ends[1], value); };
  for (const number of shown) {
    const run = data.runs[number];
    for (let k = run.first; k < run.end; k++) {
      stretch(x, run.along[k]);
      stretch(y, data.measured[k]);
      for (const model of data.models) stretch(y, model.values[k]);
      if (state.candidate) stretch(y, state.candidate.values[k]);
    }
    const means = data.models.flatMap(model => courses(data, run, model.values)).flatMap(([, , missed]) => missed);
    reach = means.reduce((most, missed) => Math.max(most, Math.abs(missed)), reach);
  }
  return { x: roomy(x), y: roomy(y), missed: [-ROOM * reach, ROOM * reach] };
}

function roomy([low, high]) {
  const margin = MARGIN * (high - low) || Math.max(Math.abs(high), 1) * 0.05;
  return [low - margin, high + margin];
}

const FONT = "12px system-ui, sans-serif";

/** One pair of axes in `element`; without `xlabel` the axis below has no numbers either. */
function pane(element, state, { ylabel, xlabel, height, draw, reset }) {
  const grid = { stroke: () => state.colours.line, width: 0.5 };
  const axis = { stroke: () => state.colours.soft, grid, ticks: { show: false }, font: FONT, labelFont: FONT, labelGap: 0, gap: 4 };
  const below = xlabel ? { size: 30, label: xlabel, labelSize: 18 } : { size: 8, values: (u, at) => at.map(() => "") };
  const scale = { auto: false, range: (u, low, high) => [low, high], min: 0, max: 1 };
  const facets = ["x", "y"].map(name => ({ scale: name, auto: false }));
  return new uPlot({
    mode: 2, width: element.clientWidth || 600, height, legend: { show: false }, padding: [8, 8, 0, 0],
    scales: { x: { time: false, ...scale }, y: scale },
    series: [null, { facets, paths: () => null, points: { show: false } }], // all is drawn by `draw`
    axes: [{ ...axis, ...below }, { ...axis, scale: "y", label: ylabel, size: 46, labelSize: 18 }],
    cursor: {
      points: { show: false }, y: false, drag: { x: true, y: true, uni: 30, dist: 6 },
      bind: { dblclick: () => () => { reset(); return null; } },
    },
    hooks: { draw: [draw], setScale: [(u, name) => name === "x" && state.follow(u)] },
  }, [null, [[0], [0]]], element);
}

/** Both panes with what moves them: `redraw`, `enlarge`, `reset`, and `nearest` to a place. */
function panesOf(figure, state) {
  const upper = figure.querySelector(".upper"), lower = figure.querySelector(".lower");
  let pair = [], all = null, following = false;
  state.follow = moved => { // the other pane shows the same part of the axis
    if (following || pair.length < 2) return;
    following = true;
    const { min, max } = moved.scales.x;
    for (const other of pair) if (other !== moved) other.setScale("x", { min, max });
    following = false;
    state.changed();
  };
  function build() {
    pair.forEach(u => u.destroy());
    pair = [];
    const { ylabel, xlabel, unit } = state.group, difference = `model \u2212 measured [${unit}]`;
    pair = [
      pane(upper, state, { reset, ylabel, xlabel: "", height: height("--upper"), draw: u => drawUpper(u, state) }),
      pane(lower, state, { reset, ylabel: difference, xlabel, height: height("--lower"), draw: u => drawLower(u, state) }),
    ];
    all = spans(state);
    reset();
  }
  function set(u, x, y) {
    u.batch(() => { u.setScale("x", { min: x[0], max: x[1] }); u.setScale("y", { min: y[0], max: y[1] }); });
  }
  function reset() { if (pair.length) { set(pair[0], all.x, all.y); set(pair[1], all.x, all.missed); } }
  /** Let the axes follow a model that leaves them or hardly fills them, unless the reader has enlarged a part. */
  function refit() {
    if (!isAll()) return;
    const needed = spans(state);
    const isOff = (has, needs) => needs[0] < has[0] || needs[1] > has[1] || 3 * (needs[1] - needs[0]) < has[1] - has[0];
    if (!isOff(all.y, needed.y) && !isOff(all.missed, needed.missed)) return;
    all = needed;
    reset();
  }
  function isAll() {
    const same = (scale, ends) => Math.abs(scale.min - ends[0]) + Math.abs(scale.max - ends[1]) < 1e-9 * (ends[1] - ends[0]);
    return pair.every(u => same(u.scales.x, all.x)) && same(pair[0].scales.y, all.y) && same(pair[1].scales.y, all.missed);
  }
  function enlarge(times, middle) { // along what is shared, around a place
    const { min, max } = pair[0].scales.x, half = (max - min) / 2 / times;
    pair[0].setScale("x", { min: middle - half, max: middle + half });
  }
  const fit = u => u.setSize({ width: u.root.parentElement.clientWidth, height: u.height });
  function height(name) { return Number(getComputedStyle(figure).getPropertyValue(name)); }
  new ResizeObserver(() => pair.forEach(fit)).observe(upper);
  return { build, reset, refit, isAll, enlarge, redraw: () => pair.forEach(u => u.redraw(false, false)), pair: () => pair };
}
