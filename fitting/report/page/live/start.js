// Everything together. If anything of it fails, the still picture stays in place.

function newState(figure, data) {
  const state = { data, values: new Float32Array(data.count), model: 0, shown: [], hovered: -1, picked: null, preview: null, candidate: null };
  state.isPale = number => {
    if (state.shown.length < 2) return false;
    if (state.picked) return !state.picked.runs.has(number);
    return state.hovered >= 0 && data.run[state.hovered] !== number;
  };
  state.colours = coloursOf(figure);
  return state;
}

function describe({ data, shown, group, model }) {
  const runs = shown.length === 1 ? data.runs[shown[0]].label : `${shown.length} runs`;
  return `Measured and model '${data.models[model].name}', ${runs}: ${group.ylabel} and misfit against ${group.xlabel}.`
    + " The arrow keys go from reading to reading.";
}

/** Redraw and say again all that depends on what the reader points at; `loud` for who listens. */
function refresher(figure, state, panes, maps) {
  return loud => {
    panes.redraw();
    showReadout(figure, state, loud);
    showRings(state, panes.pair());
    showMarks(state, maps);
  };
}

/** Move everything to a model: the curves, the values of the maps, and the bar of the error on the switch. */
function chooser(figure, state, panes, maps) {
  const { data } = state, drawn = data.maps ? data.maps.drawn : [], bar = document.querySelector(".steps .bar");
  const width = new Float64Array(1);
  const move = mover([state.values, width, ...drawn.map(map => map.now)], isMoving => {
    figure.dataset.moving = isMoving;
    if (bar) bar.style.width = isMoving ? `${width[0]}%` : "";
    paintMaps(data, maps, state.model, isMoving);
    panes.redraw();
    if (state.hovered >= 0) {
      showReadout(figure, state);
      showRings(state, panes.pair());
    }
    if (!isMoving) figure.dispatchEvent(new Event("rested"));
  });
  return (number, atOnce) => {
    paintMaps(data, maps, state.model, false);
    state.model = number;
    figure.dataset.model = number;
    figure.querySelector(".panes").setAttribute("aria-label", describe(state));
    const model = data.models[number];
    move([model.values, [model.width], ...drawn.map(map => map.values[number])], atOnce);
    showReadout(figure, state);
  };
}

function wirePointer(panes, state, point) {
  panes.pair().forEach((u, isLower) => {
    u.over.addEventListener("pointermove", event => {
      const box = u.over.getBoundingClientRect();
      point(nearest(state, u, isLower, event.clientX - box.left, event.clientY - box.top));
    });
    u.over.addEventListener("pointerleave", () => point(-1));
  });
}

/** Fill a figure with its data; what the page around it has beside it (a switch, maps) moves along. */
function begin(figure, data) {
  figure.hidden = false;
  const state = newState(figure, data), panes = panesOf(figure, state), maps = mapsOf(data);
  const refresh = refresher(figure, state, panes, maps), choose = chooser(figure, state, panes, maps);
  state.changed = () => {
    figure.querySelector(".reset").disabled = panes.isAll();
    showRings(state, panes.pair());
  };
  const point = (k, loud) => {
    if (k === state.hovered) return;
    state.hovered = k;
    refresh(loud);
  };
  wireRuns(figure, state, () => {
    fillKey(figure, state);
    panes.build();
    wirePointer(panes, state, point);
    figure.querySelector(".panes").setAttribute("aria-label", describe(state));
    refresh();
  });
  choose(wireSwitch(figure, choose), true);
  wireKeys(figure, state, panes, k => point(k, true));
  wirePicks(state, maps, refresh);
  wirePreviews(data.models, model => { state.preview = model ?? state.candidate; panes.redraw(); });
  wireCandidates(figure, state, () => { state.preview = state.candidate; panes.refit(); panes.redraw(); });
  figure.querySelector(".reset").addEventListener("click", panes.reset);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    state.colours = coloursOf(figure);
    panes.redraw();
  });
  figure.live = { state, data, panes, refresh }; // for whoever looks at it from the console
}
