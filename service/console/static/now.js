// The page of what happens now: the service's events, and for each the part of the page that tells it.

const live = document.getElementById("live");
const feed = document.getElementById("feed");
const side = document.getElementById("side");
const most = Number(live.dataset.most);

function connection(text, on) {
  live.textContent = text;
  live.classList.toggle("on", on);
}

let shown = Promise.resolve(); // one after the other, so that they stay in their order

async function show(id) {
  if (document.getElementById(`seen-${id}`)) return;
  await htmx.ajax("GET", `/observations/${id}/card`, { target: feed, swap: "afterbegin" });
  document.getElementById("nothing").hidden = true;
  const card = feed.firstElementChild;
  card.classList.add("new");
  document.getElementById("said").textContent = card.querySelector(".what").innerText;
  while (feed.children.length > most) feed.lastElementChild.remove();
}

let waiting = null; // a robot sends views fast: what is beside the observations follows a few times a second at most

function refreshSide() {
  waiting ??= setTimeout(() => {
    waiting = null;
    htmx.trigger(side, "changed");
  }, 250);
}

const events = new EventSource(`/v1/events?after=${live.dataset.after}`);
events.addEventListener("open", () => connection("live", true));
events.addEventListener("error", () => {
  const refused = events.readyState === EventSource.CLOSED; // by an answer, such as 401: a browser does not try that again
  connection(refused ? "not connected, load the page again" : "not connected, trying again", false);
  if (refused) refreshSide(); // and that leads to the sign-in where the session has ended
});
events.addEventListener("observation", (event) => {
  const { id } = JSON.parse(event.data);
  shown = shown.then(() => show(id)).catch(() => {});
  refreshSide();
});
events.addEventListener("dropped", () => location.reload());
for (const kind of live.dataset.kinds.split(" ")) events.addEventListener(kind, refreshSide);
addEventListener("pagehide", () => events.close());
