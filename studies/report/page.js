// Buttons: copy a text of the page, save a figure. They are shown only where scripts run.
"use strict";
(() => {
  const said = document.getElementById("said");
  let clearing = 0;

  function say(text) {
    said.textContent = text;
    clearTimeout(clearing);
    clearing = setTimeout(() => { said.textContent = ""; }, 2500);
  }

  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Browsers may refuse the clipboard to a page that was opened as a file.
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      const copied = document.execCommand("copy");
      area.remove();
      if (!copied) throw new Error("the browser does not let this page copy");
    }
  }

  function save(content, type, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([content], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  for (const button of document.querySelectorAll("[data-copy]")) {
    button.addEventListener("click", () =>
      copy(document.getElementById(button.dataset.copy).textContent)
        .then(() => say("Copied."), (error) => say(`Not copied: ${error.message}.`)));
  }
  for (const button of document.querySelectorAll("[data-svg]")) {
    button.addEventListener("click", () => {
      const svg = button.closest("figure").querySelector("svg");
      const text = new XMLSerializer().serializeToString(svg);
      save(`<?xml version="1.0" encoding="utf-8"?>\n${text}\n`, "image/svg+xml", `${button.dataset.svg}.svg`);
    });
  }
  for (const button of document.querySelectorAll("[data-pdf]")) {
    button.addEventListener("click", () => {
      const text = atob(button.closest("figure").querySelector("script").textContent);
      const bytes = Uint8Array.from(text, (character) => character.charCodeAt(0));
      save(bytes, "application/pdf", `${button.dataset.pdf}.pdf`);
    });
  }
  for (const group of document.querySelectorAll(".buttons")) group.hidden = false;
  addEventListener("beforeprint", () => {
    for (const folded of document.querySelectorAll("details")) folded.open = true;
  });
})();
