// Which runs are shown, and what their colours mean.

/** What can be chosen: all runs on one pair of axes, and each run alone; [numbers of runs, words] of each. */
function choicesOf(data) {
  const all = data.groups.map((group, number) => {
    const some = [...data.runs.keys()].filter(run => data.runs[run].group === number);
    return [some, `all ${some.length} over ${group.along}`];
  });
  const alone = data.runs.map((run, number) => [[number], run.label]);
  return [...all.filter(([some]) => some.length > 1).sort((a, b) => b[0].length - a[0].length), ...alone];
}

/** Let the reader choose; the choice that shows most runs comes first. `changed` is told after every choice. */
function wireRuns(figure, state, changed) {
  const list = figure.querySelector(".which select"), { data } = state, choices = choicesOf(data);
  list.append(...choices.map(([, words], number) => new Option(words, number)));
  const show = number => {
    [state.shown] = choices[number];
    state.group = data.groups[data.runs[state.shown[0]].group];
    state.hovered = -1;
    changed();
  };
  state.showRun = run => { // with all of its kind
    const number = choices.findIndex(([some]) => some.includes(run));
    list.value = number;
    show(number);
  };
  list.addEventListener("change", () => show(list.value));
  show(0);
}

/** What the colours mean: what the shown runs hold; of many the first, the middle and the last. */
function fillKey(figure, state) {
  const { data, shown } = state, runs = shown.map(number => data.runs[number]);
  const held = [...new Map(runs.map(run => [run.held, run.rank]))].sort((a, b) => a[1] - b[1]);
  const told = held.length <= 5 ? held : [held[0], held[held.length >> 1], held[held.length - 1]];
  const isDashed = runs.some(run => !(run.few && data.groups[run.group].along === "time") && data.branch.subarray(run.first, run.end).includes(ELONGATING));
  const way = state.group.along === "pressure" ? "deflating" : "elongating";
  figure.querySelector(".key").replaceChildren(
    entry("dot", "measured"),
    entry("", "model:"),
    ...told.map(([words, rank]) => entry(`h${rank}`, words)),
    ...(isDashed ? [entry("dashed", `dashed: ${way}`)] : []),
    entry("band", "expected noise of one reading (\u00b12 sigma)"),
  );
}

function entry(kind, words) {
  const all = named("", ""), mark = document.createElement("i");
  mark.className = kind;
  all.append(...(kind ? [mark] : []), words);
  return all;
}
