// The data of the page as typed arrays. Nothing in them is ever run or read as HTML.

const ARRAYS = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array };

/** Numbers that Python packed: the same type, or floats where they were put into steps; null of none. */
function unpacked(packed) {
  if (!packed) return null;
  const letters = atob(packed.bytes);
  const bytes = Uint8Array.from(letters, letter => letter.charCodeAt(0));
  const whole = new ARRAYS[packed.type](bytes.buffer);
  return "step" in packed ? Float64Array.from(whole, value => packed.low + packed.step * value) : whole;
}

/** All that the pictures draw, with `first` and `end` of every run among the readings, and `run` of every reading. */
function readData(text) {
  const data = JSON.parse(text);
  for (const name of Object.keys(data.readings)) data[name] = unpacked(data.readings[name]);
  delete data.readings;
  for (const model of data.models) model.values = unpacked(model.values);
  for (const one of data.candidates) one.values = unpacked(one.values);
  for (const map of data.maps ? data.maps.drawn : []) map.values = map.values.map(unpacked);
  data.count = data.measured.length;
  data.run = new Uint16Array(data.count);
  let first = 0;
  data.runs.forEach((run, number) => {
    run.first = first;
    run.end = first += run.count;
    run.along = data[data.groups[run.group].along];
    data.run.fill(number, run.first, run.end);
  });
  return data;
}

/** Of each branch of a run the part of the axis that every reading lies in; found once, because it never changes. */
function branchesOf(data, run) {
  return run.branches ??= [0, 1, 2].flatMap(branch => {
    const mine = Uint32Array.from({ length: run.count }, (_, k) => run.first + k).filter(k => data.branch[k] === branch);
    if (!mine.length) return [];
    if (run.few) return [{ branch, mine, part: mine.map((_, k) => k), parts: mine.length }];
    const along = [...mine].map(k => run.along[k]), low = Math.min(...along), wide = Math.max(...along) - low || 1;
    const part = Uint32Array.from(along, x => Math.min(Math.floor(data.parts * (x - low) / wide), data.parts - 1));
    return [{ branch, mine, part, parts: data.parts }];
  });
}

/** The misfit of `values`, averaged over parts of the axis, for each branch of a run: [branch, along, misfit]. */
function courses(data, run, values) {
  return branchesOf(data, run).map(({ branch, mine, part, parts }) => {
    const count = new Uint32Array(parts), along = new Float64Array(parts), missed = new Float64Array(parts);
    for (let n = 0; n < mine.length; n++) {
      const k = mine[n], at = part[n];
      count[at]++; along[at] += run.along[k]; missed[at] += values[k] - data.measured[k];
    }
    const some = [...count.keys()].filter(at => count[at]);
    return [branch, some.map(at => along[at] / count[at]), some.map(at => missed[at] / count[at])];
  });
}
