// The page that takes files: dropped or chosen, shown small, sent as a robot would send them.

import { burstOf, WrongFiles } from "./burst_files.js";

const form = document.getElementById("burst");
const drop = document.getElementById("drop");
const chosen = document.getElementById("chosen");
const previews = document.getElementById("previews");
const answer = document.getElementById("answer");
const ask = form?.querySelector("button.primary");
const PREVIEWS = 12;
let burst = null;

/** A note of text alone: file names and messages are never markup. */
function note(title, text, kind) {
  const element = document.createElement("div");
  element.className = `note ${kind}`;
  if (kind === "bad") element.setAttribute("role", "alert");
  const strong = document.createElement("strong");
  strong.textContent = title;
  const paragraph = document.createElement("p");
  paragraph.textContent = text;
  element.append(strong, paragraph);
  answer.replaceChildren(element);
}

async function choose(files) {
  answer.replaceChildren();
  previews.replaceChildren();
  burst = null;
  try {
    burst = await burstOf(files, Number(form.dataset.most));
    const views = burst.views.length;
    chosen.textContent = views ? `${views} view${views === 1 ? "" : "s"} of ${files.length} file${files.length === 1 ? "" : "s"}` : files[0].path;
    burst.views.slice(0, PREVIEWS).forEach(preview);
  } catch (error) {
    if (!(error instanceof WrongFiles)) throw error;
    chosen.textContent = "";
    note("These files are no burst", error.message, "bad");
  }
  ask.disabled = burst === null;
}

function preview(file) {
  const item = document.createElement("li");
  const image = document.createElement("img");
  image.alt = file.name;
  image.src = URL.createObjectURL(file);
  image.addEventListener("load", () => URL.revokeObjectURL(image.src));
  image.addEventListener("error", () => item.remove());
  item.append(image);
  previews.append(item);
}

const withPaths = (list) => [...list].map((file) => ({ file, path: file.webkitRelativePath || file.name }));

/** Every file below what was dropped. */
async function below(entry, prefix = "") {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    return [{ file, path: prefix + entry.name }];
  }
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject)); // a hundred at a time
    if (!some.length) break;
    found.push(...some);
  }
  return (await Promise.all(found.map((each) => below(each, `${prefix}${entry.name}/`)))).flat();
}

async function send(event) {
  event.preventDefault();
  const learn = form.elements.learn.checked;
  document.getElementById("asking").hidden = false;
  ask.disabled = true;
  answer.replaceChildren();
  try {
    const response = await fetch(`/v1/observations?learn=${learn}`, { method: "POST", body: burst.body, headers: burst.headers });
    const told = await response.json();
    if (response.ok) await show(told);
    else note(told.title, told.detail, "bad");
  } catch {
    note("No answer", "The service cannot be reached; is it still running?", "bad");
  }
  document.getElementById("asking").hidden = true;
  ask.disabled = false;
}

async function show(told) {
  const list = document.createElement("ol");
  list.className = "feed";
  answer.replaceChildren(list);
  await htmx.ajax("GET", `/observations/${told.id}/card`, { target: list, swap: "innerHTML" });
  const more = document.createElement("a");
  more.className = "button";
  more.href = `/observations/${told.id}`;
  more.textContent = "See what the answer rests on";
  answer.append(more);
}

if (form) {
  form.addEventListener("submit", send);
  for (const id of ["folder-input", "file-input"]) {
    document.getElementById(id).addEventListener("change", (event) => event.target.files.length && choose(withPaths(event.target.files)));
  }
  for (const kind of ["dragenter", "dragover"]) {
    drop.addEventListener(kind, (event) => {
      event.preventDefault();
      drop.classList.add("over");
    });
  }
  for (const kind of ["dragleave", "drop"]) drop.addEventListener(kind, () => drop.classList.remove("over"));
  drop.addEventListener("drop", async (event) => {
    event.preventDefault();
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry()).filter(Boolean);
    const files = (await Promise.all(entries.map((entry) => below(entry)))).flat();
    await choose(files.length ? files : withPaths(event.dataTransfer.files));
  });
}
