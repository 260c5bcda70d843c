// Before the first picture: what the address and the device say about it. A plain script, so that nothing waits for it.

{
  const { classList } = document.documentElement;
  // the picture at hand is of the place where everybody begins
  classList.toggle("elsewhere", location.hash.length > 1 || new URLSearchParams(location.search).has("still"));
  classList.toggle("touch", matchMedia("(pointer: coarse)").matches);
}
