// The page's screens, one of which is shown at a time.

export const $ = (id) => document.getElementById(id);

export function show(name) {
  for (const screen of document.querySelectorAll("body > main, body > section")) {
    screen.hidden = screen.id !== name;
  }
}

export function say(text) {
  $("label").textContent = text;
}

export function element(tag, properties, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

export function pressedButton(button) {
  return new Promise((resolve) => {
    button.onclick = resolve;
    // A key that is held down belongs to the screen before: it must not agree to this one.
    button.onkeydown = (event) => {
      if (event.repeat) event.preventDefault();
    };
    button.focus();
  });
}
