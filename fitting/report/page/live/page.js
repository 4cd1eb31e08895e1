// On a page: the data stand in an element, and the still picture gives way.

const place = document.getElementById("live-data"), figure = document.querySelector(".live");
const data = figure && place && window.ResizeObserver && readData(place.textContent);
if (data?.count) {
  begin(figure, data);
  for (const part of document.querySelectorAll(".with-live")) part.hidden = false;
  document.documentElement.classList.add("moved");
}
