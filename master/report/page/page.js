"use strict";
// Controls, theme and print; starts the plots.

// Inputs with their labels, one an option.
function fieldset(parent, title, options, properties) {
  const set = element(parent, "fieldset");
  element(set, "legend", {}, title);
  return options.map(({ key, label }) => {
    const labelled = element(set, "label");
    const input = element(labelled, "input", { ...properties, value: key });
    labelled.append(label);
    return input;
  });
}

// Of a control that chooses one of `values`: what to do when a person has chosen.  Where it has a
// `place` the choice stands there in the address, but for the first, and follows it.
function chosen(read, write, values, changed, place) {
  const known = () => (place && values.includes(address.get(place)) ? address.get(place) : values[0]);
  write(known());
  if (!place) return () => changed();
  address.follow(() => {
    if (read() === known()) return;
    write(known());
    changed();
  });
  return () => {
    address.set({ [place]: read() === values[0] ? "" : read() });
    changed();
  };
}

// Each control returns a function that reads it.
function radios(parent, title, options, changed, place) {
  const inputs = fieldset(parent, title, options, { type: "radio", name: title });
  const read = () => inputs.find((input) => input.checked).value;
  const write = (value) => { inputs.find((input) => input.value === value).checked = true; };
  const chose = chosen(read, write, options.map(({ key }) => key), changed, place);
  for (const input of inputs) input.addEventListener("change", chose);
  return read;
}

function checks(parent, title, keys, changed) {
  const options = keys.map((key) => ({ key, label: MODEL_NAME[key] || key }));
  const inputs = fieldset(parent, title, options, { type: "checkbox", checked: true });
  for (const input of inputs) input.addEventListener("change", () => changed());
  return () => inputs.filter((input) => input.checked).map((input) => input.value);
}

function choice(parent, title, options, changed, place) {
  const select = element(element(parent, "label", {}, `${title} `), "select");
  for (const [value, text] of options) select.add(new Option(text, value));
  const read = () => select.value;
  read.set = (value) => { select.value = value; };
  select.addEventListener("change", chosen(read, read.set, options.map(([value]) => value), changed, place));
  return read;
}

function startTheme() {
  const root = document.documentElement;
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const button = document.getElementById("theme");
  let chosen = null;
  const apply = (theme) => {
    root.dataset.theme = theme;
    button.textContent = theme === "dark" ? "Light" : "Dark";
    button.setAttribute("aria-label", `Use ${theme === "dark" ? "light" : "dark"} colours`);
    redrawAll();
  };
  const current = () => chosen ?? (dark.matches ? "dark" : "light");
  button.addEventListener("click", () => {
    chosen = current() === "dark" ? "light" : "dark";
    apply(chosen);
  });
  dark.addEventListener("change", () => apply(current()));
  addEventListener("beforeprint", () => apply("light"));
  addEventListener("afterprint", () => apply(current()));
  button.hidden = false;
  apply(current());
}

startTheme();
startTerms();
startTables();
startCopies();
startProgress();
startOperators();
startGenes();
startElite();
startFront();
startUnderstanding();
startTimeline();
startCompared();
startFilter();
startWatch();
startShape();
const pageTrials = readTrials();
if (pageTrials.length) {
  startDrives(pageTrials);
  startFloor(pageTrials);
  startPoses(pageTrials);
  startResiduals(pageTrials, PAGE.where || []);
} else {
  for (const id of ["floor-plot", "drive-plots", "pose-plots", "residual-plots"]) {
    const place = document.getElementById(id);
    if (place) place.textContent = PAGE.without_trials;
  }
}
startLive();
document.documentElement.dataset.ready = "true";
