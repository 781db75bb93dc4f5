// Starts the page.
import "./style.css";
import { App } from "./app";

declare global {
  interface Window {
    ruedo: App;
  } // for tests and the curious
}
try {
  window.ruedo = new App();
} catch (error) {
  const notice = document.getElementById("notice")!;
  notice.hidden = false;
  notice.textContent = `This browser cannot show the console: ${(error as Error).message}`;
  throw error;
}
// The token of the address is kept by a cookie.
if (location.search && location.protocol !== "file:")
  history.replaceState(null, "", `/${location.hash}`);
