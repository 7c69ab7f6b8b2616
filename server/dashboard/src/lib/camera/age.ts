/** When a picture of the camera is too old to be called live. Pure. */

/** s; cameras are slower than samples, and a picture takes its way over the network. */
const OLD_AFTER = 1;

export function isOld(age: number): boolean {
  return !(age <= OLD_AFTER);
}

/** Why the newest picture is old, for people. `waited`: s since a question that the service has not answered; 0 for none. */
export function whyOld(problem: string, waited: number): string {
  if (problem !== '') return problem;
  return isOld(waited) ? 'the service has not answered yet' : 'the camera has sent no newer picture';
}
