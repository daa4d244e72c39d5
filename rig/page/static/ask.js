// What a user asks the loop for; wishes arrive in the order in which they were made.

let last = Promise.resolve();

export function ask(wish) {
  last = last.catch(() => {}).then(() => fetch("ask", { method: "POST", body: JSON.stringify(wish) }));
  return last;
}
