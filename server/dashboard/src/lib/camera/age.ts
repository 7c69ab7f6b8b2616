/** When a picture of the camera is too old to be called live. Pure. */

/** s; cameras are slower than samples, and a picture takes its way over the network. */
const OLD_AFTER = 1;

export function isOld(age: number): boolean {
  return !(age <= OLD_AFTER);
}
