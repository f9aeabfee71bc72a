"use strict";

// Starts the page. Tests wait for `startedPage`.

const startedPage = (async () => {
  const content = JSON.parse($("document").textContent);
  const decode = (document, index) => Recording.decode(document, index);
  const [isLive, ...recordings] = await Promise.all([loadEngine(), ...content.recordings.map(decode)]);
  const page = new Page(content, recordings, isLive && content.worlds.length > 0);
  globalThis.page = page;
  await page.restore();
  addEventListener("hashchange", () => page.restore());
  return page;
})();
startedPage.catch((error) => {
  $("message").textContent = `This page cannot run here: ${messageOf(error)}`;
});
