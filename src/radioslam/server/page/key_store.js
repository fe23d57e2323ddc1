// The API key, in this tab only and gone with it.

const NAME = "radioslam-key";

export function storedKey() {
  return sessionStorage.getItem(NAME);
}

export function storeKey(key) {
  if (key) sessionStorage.setItem(NAME, key);
  else sessionStorage.removeItem(NAME);
}

export function keyHeaders() {
  const key = storedKey();
  return key ? { Authorization: `Bearer ${key}` } : {};
}
