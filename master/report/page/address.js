"use strict";
// What a person chose stands in the address of a page that a server shows, to be kept and sent.

const address = {
  get: (key) => (PAGE.served ? new URLSearchParams(location.search).get(key) || "" : ""),
  // What is empty goes.  A choice is a step that back takes back; typing is none.
  set(values, step = true) {
    if (!PAGE.served) return;
    const query = new URLSearchParams(location.search);
    for (const [key, value] of Object.entries(values)) {
      if (value) query.set(key, value);
      else query.delete(key);
    }
    const text = query.toString().replaceAll("%2F", "/");
    const next = `${location.pathname}${text ? `?${text}` : ""}`;
    if (next === location.pathname + location.search) return;
    history[step ? "pushState" : "replaceState"](null, "", next + location.hash);
    this.shown = location.search;
  },
  // Who chooses again when the address changes by back or forward.
  followers: [],
  follow(chooseAgain) {
    this.followers.push(chooseAgain);
  },
  shown: location.search,
};

addEventListener("popstate", () => {
  // The way to a place on the page is none to another view.
  if (!PAGE.served || location.search === address.shown) return;
  address.shown = location.search;
  address.followers.forEach((chooseAgain) => chooseAgain());
});

// The list's filter, while it is typed: the server looks.
function startFilter() {
  const form = document.getElementById("filter");
  if (!form) return;
  form.querySelector("button").hidden = true;
  let wait = 0;
  const changed = () => {
    clearTimeout(wait);
    wait = setTimeout(() => {
      address.set({ q: form.q.value.trim(), state: form.elements.state.value }, false);
      lookNow();
    }, 150);
  };
  address.follow(() => {
    form.q.value = address.get("q");
    form.elements.state.value = address.get("state");
    lookNow();
  });
  form.addEventListener("input", changed);
  form.addEventListener("submit", (event) => { event.preventDefault(); changed(); });
}
