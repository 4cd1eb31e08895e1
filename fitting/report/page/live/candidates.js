// Effects that the reader may try beside the model: the diagnosis has fitted them already.

/** What the model would give with an effect more, which the reader chooses; those of the model that is shown. */
function wireCandidates(figure, state, changed) {
  const { data } = state, place = figure.querySelector(".candidate"), list = place.querySelector("select");
  let model = null;
  const choose = number => { state.candidate = data.candidates[number] ?? null; changed(); };
  const fill = () => {
    if (model === state.model) return;
    model = state.model;
    const mine = [...data.candidates.keys()].filter(number => data.candidates[number].model === model);
    list.replaceChildren(new Option("nothing", ""), ...mine.map(number => new Option(data.candidates[number].name, number)));
    place.hidden = !mine.length;
    choose("");
  };
  list.addEventListener("change", () => choose(list.value));
  for (const radio of document.querySelectorAll('input[name="step"]')) radio.addEventListener("change", fill);
  fill();
}
