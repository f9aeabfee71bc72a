"use strict";

// Starts the page. Tests wait for `startedPage`.

const startedPage = (async () => {
  const content = JSON.parse($("document").textContent);
  const recordings = await Promise.all(content.recordings.map((run, index) => Recording.decode(run, index)));
  const isLive = Boolean($("engine"));
  if (isLive) await loadEngine();
  globalThis.page = isLive ? new LivePage(content, recordings) : new Page(content, recordings);
  await page.restore();
  return page;
})();
startedPage.catch((error) => {
  $("message").textContent = `This page cannot run here: ${messageOf(error)}`;
});
