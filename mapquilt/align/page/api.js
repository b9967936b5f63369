// Requests to the server of this page. Every address is relative, so that it begins with the token.

export const getJson = async (name) => (await fetch(name)).json();

export const getBytes = async (name) => (await fetch(name)).arrayBuffer();

export const call = async (name, body = {}) => {
  let answer;
  try {
    answer = await fetch(name, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  } catch {
    throw new Error("the server of this page has ended; start mapquilt align again");
  }
  const record = await answer.json();
  if (!answer.ok) throw new Error(record.error);
  return record;
};
