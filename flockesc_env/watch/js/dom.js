"use strict";

// Elements of the page.

const $ = (id) => document.getElementById(id);

function element(tag, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
}

/** A number and its unit. */
function quantity(value, unit = "m") {
  return [value, element("small", {}, ` ${unit}`)];
}

/** Offers bytes or an address as a file to save. */
function saveFile(content, name) {
  const href = typeof content === "string" ? content : URL.createObjectURL(content);
  element("a", { href, download: name }).click();
  if (href !== content) setTimeout(() => URL.revokeObjectURL(href), 60_000);
}
