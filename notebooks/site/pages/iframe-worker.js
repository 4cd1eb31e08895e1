/* The search of the site runs in a Worker, which browsers refuse to a page that was opened from disk. Then it runs in a
   frame of the page. The name of this file keeps MkDocs from fetching another shim from a server. */
if (location.protocol === "file:") {
  const load = (place, address) => new Promise((done, failed) => {
    const script = place.createElement("script");
    script.src = address;
    script.onload = done;
    script.onerror = failed;
    place.head.append(script);
  });

  window.Worker = window.IFrameWorker = class extends EventTarget {
    constructor(address) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      const place = frame.contentDocument;
      this.inner = frame.contentWindow;
      this.inner.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }));
      this.inner.importScripts = async (...addresses) => {
        for (const each of addresses) await load(place, each);
      };
      this.ready = load(place, new URL(address, location).href);
      this.frame = frame;
    }

    postMessage(data) {
      this.ready.then(() => this.inner.dispatchEvent(new MessageEvent("message", { data })));
    }

    terminate() {
      this.frame.remove();
    }
  };
}
