// What every page does: the theme's button, times in the reader's own zone, notices, and pictures that are not there.

const root = document.documentElement;

document.getElementById("theme").addEventListener("click", () => {
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
  localStorage.setItem("theme", root.dataset.theme);
  root.dispatchEvent(new CustomEvent("themechange"));
});

const units = [["day", 86400], ["hour", 3600], ["minute", 60]];
const relative = new Intl.RelativeTimeFormat("en", { numeric: "auto" });
const exact = new Intl.DateTimeFormat("en-GB", { dateStyle: "medium", timeStyle: "medium" });

function wordTime(element) {
  const then = new Date(element.dateTime);
  const seconds = (Date.now() - then) / 1000;
  const unit = units.find(([, size]) => seconds >= size);
  element.textContent = unit ? relative.format(-Math.floor(seconds / unit[1]), unit[0]) : "just now";
  element.title = exact.format(then);
}

function wordTimes(within = document) {
  within.querySelectorAll("time[data-relative]").forEach(wordTime);
}

wordTimes();
setInterval(wordTimes, 30_000);
document.addEventListener("htmx:load", (event) => wordTimes(event.detail.elt));

// Failures to reach the service are told in a corner, the last one for a few seconds.
document.addEventListener("htmx:sendError", () => {
  const element = document.createElement("p");
  element.className = "note bad";
  element.textContent = "The service cannot be reached.";
  document.getElementById("notices").replaceChildren(element);
  setTimeout(() => element.remove(), 6000);
});

// Tabs that htmx answers: the one pressed last is the current one.
document.addEventListener("click", (event) => {
  const tab = event.target.closest("[data-tab]");
  tab?.parentElement.querySelectorAll("[data-tab]").forEach((each) => each.toggleAttribute("aria-current", false));
  tab?.setAttribute("aria-current", "true");
});

// A field that makes sense only while a choice is left at its first, empty option.
document.querySelectorAll("[data-only-for]").forEach((field) => {
  const choice = document.getElementById(field.dataset.onlyFor);
  const follow = () => (field.hidden = choice.value !== "");
  choice.addEventListener("change", follow);
  follow();
});
