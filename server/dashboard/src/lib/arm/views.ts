/** Where the camera stands: pure geometry about the arm's middle, z up. */

import type { Vector } from './chain';

/** Direction from the target to the camera, and how far it is. Angles in rad, distance in m. */
export interface View {
  /** From the x axis towards y. */
  readonly azimuth: number;
  /** Above the horizon. */
  readonly elevation: number;
  readonly distance: number;
}

export const VIEWS = {
  corner: { label: 'Corner', azimuth: -2.2, elevation: 0.38 },
  front: { label: 'Front', azimuth: Math.PI, elevation: 0.06 },
  side: { label: 'Side', azimuth: -Math.PI / 2, elevation: 0.06 },
  top: { label: 'Top', azimuth: -Math.PI / 2, elevation: 1.5 },
} as const;
export type ViewName = keyof typeof VIEWS;

const STEEPEST = 1.5;
const NEAREST = 0.35;
const FARTHEST = 3;

/** The distance from which a sphere of `radius` fills a picture of `aspect` (width / height). `fieldOfView`: vertical, rad. */
export function fittingDistance(radius: number, fieldOfView: number, aspect: number): number {
  const half = fieldOfView / 2;
  const narrower = aspect < 1 ? Math.atan(Math.tan(half) * aspect) : half;
  return radius / Math.sin(narrower);
}

export function viewNamed(name: ViewName, distance: number): View {
  const { azimuth, elevation } = VIEWS[name];
  return { azimuth, elevation, distance };
}

/** The view after turning about the target and coming nearer (`zoom` < 1), within what still shows the arm. */
export function turned(view: View, azimuth: number, elevation: number, zoom: number, fitting: number): View {
  return {
    azimuth: view.azimuth + azimuth,
    elevation: limited(view.elevation + elevation, -STEEPEST, STEEPEST),
    distance: limited(view.distance * zoom, NEAREST * fitting, FARTHEST * fitting),
  };
}

/** Where the camera is. */
export function cameraAt(view: View, target: Vector): Vector {
  const across = view.distance * Math.cos(view.elevation);
  return [
    target[0] + across * Math.cos(view.azimuth),
    target[1] + across * Math.sin(view.azimuth),
    target[2] + view.distance * Math.sin(view.elevation),
  ];
}

/** The view of a camera: the inverse of `cameraAt`. */
export function viewFrom(camera: Vector, target: Vector): View {
  const [x, y, z] = camera.map((value, index) => value - target[index]!) as [number, number, number];
  const distance = Math.hypot(x, y, z);
  return { azimuth: Math.atan2(y, x), elevation: Math.asin(z / distance), distance };
}

/** What a key does to a view: azimuth, elevation (rad) and zoom; null for a key that is not ours. */
export function turnOfKey(key: string): readonly [number, number, number] | null {
  const step = Math.PI / 36;
  switch (key) {
    case 'ArrowLeft':
      return [-step, 0, 1];
    case 'ArrowRight':
      return [step, 0, 1];
    case 'ArrowUp':
      return [0, step, 1];
    case 'ArrowDown':
      return [0, -step, 1];
    case '+':
    case '=':
      return [0, 0, 1 / 1.15];
    case '-':
      return [0, 0, 1.15];
    default:
      return null;
  }
}

function limited(value: number, low: number, high: number): number {
  return Math.min(high, Math.max(low, value));
}
