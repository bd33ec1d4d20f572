"use strict";
// Any drive of a run's log, measured and simulated, played from above.  A server simulates it.

const placeAt = (path, t) => {
  const next = path.findIndex((p) => p[0] >= t);
  if (next === 0) return path[0];
  if (next < 0) return path.at(-1);
  const [a, b] = [path[next - 1], path[next]];
  const s = (t - a[0]) / (b[0] - a[0] || 1);
  return a.map((v, i) => v + s * (b[i] - v));
};

const WATCHED = [
  { key: "before", style: "tuned", dashed: true, shape: "diamond" },
  { key: "best", style: "final", shape: "dot" },
  { key: "measured", style: "measured", shape: "cross" },
];

// An end alone becomes an arc, which is drawn faintly.
function watchedPaths(drive) {
  return WATCHED.filter(({ key }) => drive[key]?.length).map((line) => {
    const [, x, y, theta] = drive[line.key].at(-1);
    return { ...line, ...pathOrArc(drive[line.key], { x, y, theta }, drive.duration_s) };
  });
}

// A piece's corners where it is now, closed.
const outlineAt = (outline, [, x, y, theta]) => [...outline, outline[0]].map(([a, b]) => [
  0, x + a * Math.cos(theta) - b * Math.sin(theta), y + a * Math.sin(theta) + b * Math.cos(theta)]);

function watchSpec(lines, t, { outline, finger }) {
  const far = Math.max(0.02, ...lines.flatMap(({ path }) => path.map(([, x, y]) => Math.hypot(x, y))));
  const [unit, each] = far < 2 ? ["mm", 1000] : ["m", 1];
  const place = ([, x, y]) => [each * x, each * y];
  const layers = lines.map(({ key, style, dashed, known, path }) => (
    { kind: "line", style, dashed: dashed || !known, width: 2, faint: known ? 0.8 : 0.4, name: `${key} path`, points: path.map(place) }));
  // Nobody knows when a piece moved of which only the end was measured.
  const outlines = (at) => (outline ? lines : []).map(({ key, style, dashed, known, path }) => (
    { kind: "line", style, dashed, width: 1.5, name: `${key} outline`, points: outlineAt(outline, placeAt(path, known ? at : Infinity)).map(place) }));
  if (finger) {
    layers.push({ kind: "line", style: "quiet", dashed: true, width: 1, name: "finger's way", points: finger.map(place) });
    layers.push({ kind: "points", style: "quiet", shape: "dot", name: "finger now", points: [place(placeAt(finger, t))] });
  }
  // What is seen at any time has room: the frame stands still.
  const spec = framed([...layers, ...outlines(0), ...outlines(Infinity)], [`ahead of the start, ${unit}`, `left of the start, ${unit}`]);
  layers.push(...outlines(t));
  for (const { key, style, shape, path } of lines) {
    const now = placeAt(path, t);
    const [x, y] = place(now);
    const length = 0.1 * each * far;
    layers.push({ kind: "arrows", style, width: 2.5, name: `${key} heading`, arrows: [[x, y, x + length * Math.cos(now[3]), y + length * Math.sin(now[3])]] });
    layers.push({ kind: "points", style, shape, name: `${key} now`, points: [[x, y]] });
  }
  return { ...spec, layers, equal: true };
}

function startWatch() {
  const parent = document.getElementById("watch-plot");
  if (!parent) return;
  const controls = document.getElementById("watch-controls");
  const number = (title, most) => {
    const label = element(controls, "label", {}, `${title} `);
    return element(label, "input", { type: "number", min: 1, max: most, step: 1, name: title });
  };
  const what = PAGE.windows ? "Window" : "Trial";
  const trial = number(what, PAGE.logged_trials + PAGE.held_out);
  if (PAGE.held_out) {
    element(controls, "span", { className: "quiet" }, `${PAGE.logged_trials + 1} to ${PAGE.logged_trials + PAGE.held_out}: held out`);
  }
  const generation = number("Best of generation", PAGE.generations.at(-1)?.generation || 1);
  trial.value = address.get("trial") || 1;
  generation.placeholder = "last";
  generation.value = address.get("generation");
  const show = element(controls, "button", { type: "button" }, "Show");
  const play = element(controls, "button", { type: "button", disabled: true }, "Play");
  const scrub = element(element(controls, "label", { className: "scrub" }, "Time "), "input", { type: "range", min: 0, max: 1000, value: 1000, disabled: true });
  const caption = document.getElementById("watch-said");
  const chart = new Chart(parent, 0.7, true);
  chart.figure.hidden = true;  // until there is a drive
  let [drive, lines, end, frame] = [null, [], 1, 0];

  const time = () => (scrub.valueAsNumber / 1000) * end;
  const draw = () => {
    scrub.setAttribute("aria-valuetext", `${numberText(time())} s of ${numberText(end)} s`);
    chart.figure.hidden = false;
    chart.figure.classList.toggle("apart", drive.held_out);
    chart.show(watchSpec(lines, time(), drive), `${drive.title}, at ${time().toFixed(2)} s of ${numberText(end)} s`, drive.note, true);
  };
  const stop = () => {
    cancelAnimationFrame(frame);
    frame = 0;
    play.textContent = "Play";
  };
  function start() {
    if (scrub.valueAsNumber >= 1000) scrub.value = 0;
    const from = performance.now() - 1000 * time();
    play.textContent = "Pause";
    const step = (now) => {
      scrub.value = Math.min(1000, (now - from) / end);
      draw();
      if (scrub.valueAsNumber >= 1000) return stop();
      frame = requestAnimationFrame(step);
    };
    frame = requestAnimationFrame(step);
  }

  // `step`: a person asked for it.
  async function load(step) {
    stop();
    caption.textContent = "Asked for it; a simulation takes about a second.";
    const wanted = new URLSearchParams({ of: PAGE.run, trial: trial.value || "1" });
    if (generation.value) wanted.set("generation", generation.value);
    try {
      const answer = await fetch(`/drive?${wanted}`, { signal: AbortSignal.timeout(30000) });
      if (!answer.ok) throw new Error((await answer.text()).trim());
      drive = await answer.json();
      lines = watchedPaths(drive);
      end = Math.max(...lines.map(({ path }) => path.at(-1)[0]));
      scrub.disabled = play.disabled = false;
      scrub.value = 1000;
      caption.textContent = drive.said;
      chart.zoom = null;
      draw();
      address.set({ trial: wanted.get("trial"), generation: wanted.get("generation") }, step);
    } catch (error) {
      caption.textContent = `It cannot be shown: ${error.message}`;
    }
    parent.dataset.shown = caption.textContent;
  }

  show.addEventListener("click", () => load(true));
  for (const input of [trial, generation]) input.addEventListener("keydown", (event) => event.key === "Enter" && load(true));
  address.follow(() => {
    const [last, of] = [address.get("trial") || "1", address.get("generation")];
    if (trial.value === last && generation.value === of) return;
    [trial.value, generation.value] = [last, of];
    load(false);
  });
  play.addEventListener("click", () => (frame ? stop() : start()));
  scrub.addEventListener("input", () => { stop(); draw(); });
  load(false);
}
