"use strict";
// A page that a server shows looks again while it is open: what changed is put in its place.  The
// server says when there is something new (server-sent events); where it cannot, or does not, the
// page asks by itself.

const LOOK_MS = 2000;
const EVENT_LOOK_MS = 60000;  // while it is reported
let lookNow = () => {};
const redraws = [];  // of plots whose data may change

// Now, and whenever the data may have changed; only then the plot keeps its zoom.
function drawLive(draw) {
  redraws.push(() => draw(true));
  draw(false);
}

// What a person has chosen or stands on, by what it says.
const nameOf = (e) => e.getAttribute("href") || `${e.name || ""}=${e.value || e.id}`;

function putInPlace(element, html) {
  const inside = element.contains(document.activeElement) ? nameOf(document.activeElement) : null;
  const checked = new Set([...element.querySelectorAll("input:checked")].map(nameOf));
  element.innerHTML = html;
  for (const input of element.querySelectorAll("input")) input.checked = checked.has(nameOf(input));
  if (inside) [...element.querySelectorAll("a, button, input")].find((e) => nameOf(e) === inside)?.focus({ preventScroll: true });
  startTables(element);
  startCopies(element);
}

function startLive() {
  if (!PAGE.served) return;
  const line = document.getElementById("live");
  const shown = new Map();
  const sections = (page) => [...page.querySelectorAll("section")].map((s) => s.id).join(" ");
  const path = location.pathname;
  let etag = "";
  let since = null;
  let events = null;
  let looking = null;

  function show(trouble) {
    since = trouble ? since ?? new Date().toLocaleTimeString() : null;
    const text = trouble ? `${trouble} What stands here is from ${since} or before; it is asked again all the time.` : "";
    if (line.textContent !== text) line.textContent = text;
  }

  function update(text) {
    const page = new DOMParser().parseFromString(text, "text/html");
    if (sections(page) !== sections(document)) return location.reload();
    document.title = page.title;
    for (const fresh of page.querySelectorAll("[data-live]")) {
      const element = document.getElementById(fresh.id);
      if (element && shown.get(fresh.id) !== fresh.innerHTML) putInPlace(element, fresh.innerHTML);
      shown.set(fresh.id, fresh.innerHTML);
    }
    Object.assign(PAGE, JSON.parse(page.getElementById("page").textContent));
    redraws.forEach((draw) => draw());
  }

  // Why, from a page that shows it or in plain language; what stands here is kept.
  function refused(answer, text) {
    const isPage = (answer.headers.get("Content-Type") || "").startsWith("text/html");
    const why = isPage ? new DOMParser().parseFromString(text, "text/html").getElementById("why")?.textContent || "" : text;
    const shown = document.getElementById("why");
    if (shown) shown.textContent = why;
    else show(`The server says: ${why.slice(0, 300).trim()}`);
  }

  async function look() {
    try {
      const answer = await fetch(location.href.split("#")[0], {
        cache: "no-store", headers: etag ? { "If-None-Match": etag } : {}, signal: AbortSignal.timeout(20000),
      });
      if (answer.status === 304) return show("");
      if (!answer.ok) return refused(answer, await answer.text());
      update(await answer.text());
      etag = answer.headers.get("ETag") || "";
      show("");
    } catch {
      show("The server does not answer; gapfarm serve starts it again.");
    }
    document.documentElement.dataset.looked = String(Number(document.documentElement.dataset.looked || 0) + 1);
  }

  // One look after the other, none while nobody sees the page.
  lookNow = () => {
    looking = (looking || Promise.resolve()).then(() => (document.hidden ? null : look()));
    return looking;
  };

  // A page that nobody sees gives its connection back.
  function listen() {
    if (document.hidden || events || !window.EventSource) return;
    const query = new URLSearchParams(location.search);
    query.set("at", path);
    events = new EventSource(`/events?${query}`);
    events.onmessage = ({ data }) => `"${data}"` !== etag && lookNow();
    events.onerror = () => {
      // Refused: there is no asking again.  Else the browser connects again by itself.
      if (events.readyState === EventSource.CLOSED) events = null;
    };
  }
  const listening = () => events?.readyState === EventSource.OPEN;
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) {
      events?.close();
      events = null;
    } else {
      lookNow();
      listen();
    }
  });

  let asked = performance.now();
  const again = async () => {
    if (performance.now() - asked >= (listening() ? EVENT_LOOK_MS : LOOK_MS)) {
      await lookNow();
      asked = performance.now();
    }
    document.documentElement.dataset.told = String(Boolean(listening()));
    setTimeout(again, LOOK_MS / 2);
  };
  listen();
  setTimeout(again, LOOK_MS);
}
