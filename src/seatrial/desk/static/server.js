// Requests to the server of this page; what it refuses is an Error with its words.

const PIECE = 4 * 2 ** 20;  // bytes of a dropped file that go at once

async function answered(response) {
  let said = {};
  try { said = await response.json(); } catch { /* no JSON: told below */ }
  if (!response.ok) throw new Error(said.error ?? said.detail?.[0]?.msg ?? `the server answers ${response.status}`);
  return said;
}

const address = (...parts) => parts.join("/").split("/").map(encodeURIComponent).join("/");

export const look = (...parts) => fetch(address(...parts)).then(answered);
export const file = path => address("files", path);
export const send = (method, path, said) =>
  fetch(path, { method, body: JSON.stringify(said) }).then(answered);
export const text = (path, was, now) => send("PUT", address("api/text", path), { was, text: now });
export const command = (key, values, run) => send("POST", `api/command/${key}?run=${run}`, values);
export const job = (number, since) => fetch(`api/jobs/${number}?since=${since}`).then(answered);
export const stop = number => send("POST", `api/jobs/${number}/stop`, {});

/** A dropped file in pieces; `each` hears the share that is there. */
export async function upload(chosen, each) {
  let at = 0, there = {};
  do {
    const piece = chosen.slice(at, at + PIECE), last = at + piece.size >= chosen.size;
    there = await fetch(`${address("api/files", chosen.name)}?at=${at}&last=${last}`, { method: "PUT", body: piece }).then(answered);
    at += piece.size;
    each(chosen.size ? at / chosen.size : 1);
  } while (at < chosen.size);
  return there.path;
}
