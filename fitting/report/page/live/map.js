// The map of where the model fails: its cells point at readings, readings point at cells, and it moves with the model.

const SVG = "http://www.w3.org/2000/svg";

/** Every drawn map with its cells, for every model: `cells[number]` is the path of one, in the order of its values. */
function mapsOf(data) {
  const found = [];
  if (!data.maps) return found;
  const columns = data.maps.columns.length, size = data.maps.rows.length * columns, seen = {};
  for (const map of data.maps.drawn) {
    const n = seen[map.kind] ??= 0;
    seen[map.kind]++;
    map.now = Float32Array.from(map.values[0]);
    data.models.forEach((_, model) => {
      const figure = document.querySelectorAll(`.stack.${map.kind} > .m${model} > figure`)[n];
      const mesh = figure?.querySelector('[id$="-cells"]'), cells = [...(mesh?.children || [])];
      if (cells.length === size) found.push({ map, model, mesh, cells, styles: cells.map(cell => cell.getAttribute("style")) });
    });
  }
  return found;
}

/** The colour of a misfit: the step that it lies on. */
function shadeOf(data, value) {
  return data.maps.shades[data.maps.ends.filter(end => end <= value).length];
}

/** Paint the maps of one model with the values of the moment; at rest they are as they were printed. */
function paintMaps(data, maps, model, isMoving) {
  for (const { map, cells, styles, model: own } of maps) {
    if (own !== model || (isMoving && !cells[0].checkVisibility?.())) continue; // nobody sees the other division
    cells.forEach((cell, k) => {
      if (!isMoving) return cell.setAttribute("style", styles[k]);
      if (!Number.isFinite(map.now[k])) return;
      const [colour, opacity] = shadeOf(data, map.now[k]);
      cell.style.fill = colour;
      cell.style.fillOpacity = opacity;
    });
  }
}
