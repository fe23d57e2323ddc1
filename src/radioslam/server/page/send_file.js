// Sends a file and tells how much of it went; fetch cannot tell, so this is the older way.

import { address, Refused, refusal } from "./api.js";
import { keyHeaders } from "./key_store.js";

export function sendFile(path, file, onProgress) {
  return new Promise((done, failed) => {
    const request = new XMLHttpRequest();
    request.open("POST", address(path, { name: file.name }));
    for (const [name, value] of Object.entries(keyHeaders())) request.setRequestHeader(name, value);
    request.upload.addEventListener("progress", (event) => onProgress(event.lengthComputable ? event.loaded / event.total : 0));
    request.upload.addEventListener("load", () => onProgress(1));
    request.addEventListener("error", () => failed(new Refused(0, "the connection broke; is the file too large, or the service away?")));
    request.addEventListener("load", () => {
      if (request.status >= 200 && request.status < 300) done(JSON.parse(request.responseText));
      else failed(refusal(request.status, request.responseText));
    });
    request.send(file);
  });
}
