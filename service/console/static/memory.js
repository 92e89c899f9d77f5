// Sends the file of an export to the service, and says how far it is: browsers tell that of uploads to XMLHttpRequest only.

const form = document.getElementById("import");

form?.addEventListener("submit", (event) => {
  event.preventDefault();
  const [file] = document.getElementById("archive").files;
  const button = form.querySelector("button");
  const progress = document.getElementById("import-progress");
  const note = document.getElementById("import-note");

  function say(text, bad = false) {
    note.textContent = text;
    note.className = text ? `note${bad ? " bad" : ""}` : "";
  }

  function failed(text) {
    progress.hidden = true;
    button.disabled = false;
    say(text, true);
  }

  const request = new XMLHttpRequest();
  request.open("POST", "/v1/memory/import");
  request.setRequestHeader("Content-Type", "application/zip");
  request.setRequestHeader("X-Actor", "console");
  request.setRequestHeader("Idempotency-Key", Array.from(crypto.getRandomValues(new Uint8Array(16)), (each) => each.toString(16).padStart(2, "0")).join(""));
  request.responseType = "json";
  request.upload.addEventListener("progress", ({ loaded, total }) => {
    progress.value = loaded / total;
    say(`Sending ${file.name}: ${Math.round((100 * loaded) / total)} %`);
  });
  request.upload.addEventListener("load", () => {
    progress.removeAttribute("value");
    say("Checking every entry of the file …");
  });
  request.addEventListener("load", () => {
    if (request.status === 201) location.assign(`/memory?change=${request.response.entry_id}`);
    else failed(request.response?.detail ?? `The service answered ${request.status}.`);
  });
  request.addEventListener("error", () => failed("The service cannot be reached."));
  progress.hidden = false;
  progress.value = 0;
  button.disabled = true;
  say(`Sending ${file.name}`);
  request.send(file);
});
