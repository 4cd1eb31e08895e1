// From model to model: the curves, the map and the bar of the error move together, and end at exactly the values sent.

const DURATION = 500, PAUSE = 600; // ms of one step, and between the end of one and the next when they are played
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** Slow, fast, slow: 0 at 0, 1 at 1. */
const eased = t => t * t * (3 - 2 * t);

/** Lists of numbers that move at once: `to(targets)` sends them there, `shown(isMoving)` is called after every move. */
function mover(lists, shown) {
  let frame = 0;
  return function to(targets, atOnce) {
    cancelAnimationFrame(frame);
    const from = lists.map(list => list.slice());
    const end = () => { lists.forEach((list, n) => list.set(targets[n])); shown(false); };
    if (atOnce || calm.matches) return end();
    let begun;
    const step = now => {
      begun ??= now;
      const t = (now - begun) / DURATION;
      if (t >= 1) return end();
      const share = eased(t);
      lists.forEach((list, n) => {
        const a = from[n], b = targets[n];
        for (let k = 0; k < list.length; k++) list[k] = a[k] + (b[k] - a[k]) * share;
      });
      shown(true);
      frame = requestAnimationFrame(step);
    };
    shown(true);
    frame = requestAnimationFrame(step);
  };
}

/** The switch of the page: the radio buttons of its models, and the buttons of the picture that press them. */
function wireSwitch(figure, chosen) {
  const radios = [...document.querySelectorAll('input[name="step"]')];
  const at = () => Math.max(radios.findIndex(radio => radio.checked), 0);
  const [back, forward, play] = ["back", "forward", "play"].map(name => figure.querySelector(`.${name}`));
  let isPlaying = false, timer = 0;
  const stop = () => {
    clearTimeout(timer);
    isPlaying = false;
    play.setAttribute("aria-pressed", "false");
    play.textContent = "Watch the error fall";
  };
  const ends = () => { back.disabled = at() === 0; forward.disabled = at() >= radios.length - 1; };
  const press = number => {
    radios[number].checked = true;
    radios[number].dispatchEvent(new Event("change", { bubbles: true }));
  };
  const go = number => { stop(); press(Math.min(Math.max(number, 0), radios.length - 1)); };
  figure.addEventListener("rested", () => { // not by the clock alone: a slow browser shows every model too
    if (!isPlaying) return;
    if (at() + 1 < radios.length) timer = setTimeout(() => press(at() + 1), PAUSE);
    else stop();
  });
  for (const radio of radios) {
    radio.addEventListener("change", event => {
      if (event.isTrusted) stop(); // the reader takes over
      ends();
      chosen(at());
    });
  }
  back.addEventListener("click", () => go(at() - 1));
  forward.addEventListener("click", () => go(at() + 1));
  play.addEventListener("click", () => {
    if (isPlaying) return stop();
    isPlaying = true;
    play.setAttribute("aria-pressed", "true");
    play.textContent = "Stop";
    press(0);
  });
  figure.querySelector(".steps-of-it").hidden = radios.length < 2;
  ends();
  return at();
}

/** A bar that stands for a model shows, while one points at it, what that model would give. */
function wirePreviews(models, preview) {
  for (const row of document.querySelectorAll("label.row")) {
    const number = Number(row.htmlFor.replace("step", ""));
    row.addEventListener("pointerenter", () => preview(models[number]));
    row.addEventListener("pointerleave", () => preview(null));
  }
  for (const radio of document.querySelectorAll('input[name="step"]')) {
    const label = radio.closest("label");
    label?.addEventListener("pointerenter", () => preview(models[Number(radio.id.replace("step", ""))]));
    label?.addEventListener("pointerleave", () => preview(null));
  }
}
