// Requests to the service; every error becomes a Refused with the service's own words.

import { keyHeaders } from "./key_store.js";

const BASE = new URL("../", document.baseURI);

export class Refused extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

export function address(path, parameters = {}) {
  const url = new URL(path, BASE);
  for (const [name, value] of Object.entries(parameters)) {
    if (value !== null && value !== undefined) url.searchParams.set(name, value);
  }
  return url;
}

export async function request(method, path, { parameters, body, headers, signal } = {}) {
  let response;
  try {
    response = await fetch(address(path, parameters), {
      method, body, signal, cache: "no-store", headers: { ...keyHeaders(), ...headers },
    });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Refused(0, "the service does not answer; is it running?");
  }
  if (!response.ok) throw refusal(response.status, await response.text());
  return response;
}

export function refusal(status, text) {
  if (status === 401) document.dispatchEvent(new Event("keyneeded"));
  try {
    return new Refused(status, JSON.parse(text).error.message);
  } catch {
    return new Refused(status, `the service answered with status ${status}`);
  }
}

export async function getJson(path, parameters) {
  return (await request("GET", path, { parameters })).json();
}

export async function sendJson(method, path, content) {
  const headers = content === undefined ? {} : { "Content-Type": "application/json" };
  const body = content === undefined ? undefined : JSON.stringify(content);
  const response = await request(method, path, { body, headers });
  return response.status === 204 ? null : response.json();
}
