"use strict";
// Controls, theme and print; starts the plots.

function labelled(parent, input, text) {
  const label = parent.appendChild(document.createElement("label"));
  label.append(input, text);
  return input;
}

function fieldset(parent, title) {
  const set = parent.appendChild(document.createElement("fieldset"));
  set.appendChild(document.createElement("legend")).textContent = title;
  return set;
}

// Each control returns a function that reads it.  Where it has a `place` its choice stands there in
// the address.
function radios(parent, title, options, changed, place) {
  const set = fieldset(parent, title);
  const known = place && options.some(({ key }) => key === address.get(place)) ? address.get(place) : options[0].key;
  const inputs = options.map(({ key, label }) => {
    const input = Object.assign(document.createElement("input"), { type: "radio", name: title, value: key, checked: key === known });
    input.addEventListener("change", () => {
      if (place) address.set({ [place]: key === options[0].key ? "" : key });
      changed();
    });
    return labelled(set, input, label);
  });
  if (place) {
    address.follow(() => {
      const again = inputs.find((input) => input.value === address.get(place)) || inputs[0];
      if (again.checked) return;
      again.checked = true;
      changed();
    });
  }
  return () => inputs.find((input) => input.checked).value;
}

function checks(parent, title, keys, changed) {
  const set = fieldset(parent, title);
  const inputs = keys.map((key) => {
    const input = Object.assign(document.createElement("input"), { type: "checkbox", value: key, checked: true });
    input.addEventListener("change", changed);
    return labelled(set, input, MODEL_NAME[key] || key);
  });
  return () => inputs.filter((input) => input.checked).map((input) => input.value);
}

function choice(parent, title, options, changed, place) {
  const label = parent.appendChild(document.createElement("label"));
  const select = document.createElement("select");
  for (const [value, text] of options) select.add(new Option(text, value));
  if (place && options.some(([value]) => value === address.get(place))) select.value = address.get(place);
  select.addEventListener("change", () => {
    if (place) address.set({ [place]: select.value === options[0][0] ? "" : select.value });
    changed();
  });
  if (place) {
    address.follow(() => {
      const known = options.map(([value]) => value);
      const again = known.includes(address.get(place)) ? address.get(place) : known[0];
      if (select.value === again) return;
      select.value = again;
      changed();
    });
  }
  label.append(`${title} `, select);
  const read = () => select.value;
  read.set = (value) => { select.value = value; };
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
  startOutliers(pageTrials);
  startPoses(pageTrials);
  startResiduals(pageTrials, PAGE.where || []);
} else {
  for (const id of ["floor-plot", "stray-plots", "drive-plots", "pose-plots", "residual-plots"]) {
    const place = document.getElementById(id);
    if (place) place.textContent = PAGE.without_trials;
  }
}
startLive();
document.documentElement.dataset.ready = "true";
