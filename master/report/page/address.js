"use strict";
// What a person chose stands in the address of a page that a server shows, to be kept and sent.

const address = {
  get: (key) => (PAGE.served ? new URLSearchParams(location.search).get(key) || "" : ""),
  // What is empty goes.
  set(values) {
    if (!PAGE.served) return;
    const query = new URLSearchParams(location.search);
    for (const [key, value] of Object.entries(values)) {
      if (value) query.set(key, value);
      else query.delete(key);
    }
    const text = query.toString().replaceAll("%2F", "/");
    history.replaceState(null, "", `${location.pathname}${text ? `?${text}` : ""}${location.hash}`);
  },
};

// The list's filter, while it is typed: the server looks.
function startFilter() {
  const form = document.getElementById("filter");
  if (!form) return;
  form.querySelector("button").hidden = true;
  let wait = 0;
  const changed = () => {
    clearTimeout(wait);
    wait = setTimeout(() => {
      address.set({ q: form.q.value.trim(), state: form.elements.state.value });
      lookNow();
    }, 150);
  };
  form.addEventListener("input", changed);
  form.addEventListener("submit", (event) => { event.preventDefault(); changed(); });
}
