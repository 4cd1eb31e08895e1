// The picture without a pointer: from reading to reading, from run to run, enlarged and reduced.

const TIMES = 1.6, STRIDES = 20; // of one press of plus; steps through a run with the shift key

/** What each key does from where the reader is. `point(reading)` is told where a key goes. */
function actions({ data, shown, hovered }, panes, point, isFast) {
  const run = data.runs[hovered < 0 ? shown[0] : data.run[hovered]], place = shown.indexOf(data.runs.indexOf(run));
  const stride = isFast ? Math.max(Math.round(run.count / STRIDES), 1) : 1;
  const middle = hovered < 0 ? (run.along[run.first] + run.along[run.end - 1]) / 2 : run.along[hovered];
  const along = step => point(hovered < 0 ? run.first : Math.min(Math.max(hovered + step, run.first), run.end - 1));
  const across = step => {
    const to = data.runs[shown[Math.min(Math.max(place + step, 0), shown.length - 1)]];
    point(hovered < 0 ? run.first : to.first + Math.min(hovered - run.first, to.count - 1));
  };
  return {
    ArrowRight: () => along(stride), ArrowLeft: () => along(-stride), ArrowUp: () => across(1), ArrowDown: () => across(-1),
    "+": () => panes.enlarge(TIMES, middle), "=": () => panes.enlarge(TIMES, middle), "-": () => panes.enlarge(1 / TIMES, middle),
    Home: panes.reset, Escape: () => { point(-1); panes.reset(); },
  };
}

function wireKeys(figure, state, panes, point) {
  figure.querySelector(".panes").addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const action = actions(state, panes, point, event.shiftKey)[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}
