"use strict";

// Starts the page. Tests wait for `startedPage`.

const startedPage = (async () => {
  document.body.classList.add("scripted");
  const content = JSON.parse($("document").textContent);
  const recordings = await Promise.all(content.recordings.map((run, index) => Recording.decode(run, index)));
  const isLive = Boolean($("engine"));
  if (isLive) await loadEngine();
  globalThis.page = isLive ? new LivePage(content, recordings) : new Page(content, recordings);
  await page.restore();
  return page;
})();
startedPage.catch((error) => {
  document.body.classList.remove("scripted");
  $("unscripted").insertAdjacentHTML("afterbegin", $("film").textContent); // the content of <noscript>
  $("unable").textContent = `This page cannot fly flocks here: ${messageOf(error)}`;
});
