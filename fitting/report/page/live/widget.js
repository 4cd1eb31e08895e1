// In the workbench: the data come once for a model, and then, with every move of a slider, the values of the model.

/** Fill an element with the picture of a model, and give back what draws other values into it. */
function filled(place, content) {
  place.innerHTML = SKELETON;
  const figure = place.querySelector(".live"), data = readData(content);
  begin(figure, data);
  const { state, panes, refresh } = figure.live;
  data.models[0].values = state.values; // the axes are to fit the model of the moment
  return sent => {
    if (sent.byteLength !== state.values.byteLength) return; // of another model
    state.values.set(new Float32Array(sent.buffer.slice(sent.byteOffset, sent.byteOffset + sent.byteLength)));
    figure.dataset.moves = Number(figure.dataset.moves || 0) + 1;
    panes.refit();
    if (state.hovered >= 0) refresh();
    else panes.redraw();
  };
}

function render({ model, el }) {
  const said = document.createElement("div"), place = document.createElement("div");
  el.replaceChildren(said, place);
  let draw = () => {};
  const show = () => draw(model.get("values"));
  const say = () => { said.innerHTML = model.get("said"); }; // made by the program, with all names escaped
  const fill = () => {
    if (model.get("content")) draw = filled(place, model.get("content"));
    show();
  };
  model.on("change:content", fill);
  model.on("change:values", show);
  model.on("change:said", say);
  say();
  fill();
  return () => { model.off("change:content", fill); model.off("change:values", show); model.off("change:said", say); };
}

export default { render };
