/** The geometries of meshes that others' files hold, without their materials. */

import { type BufferGeometry, Mesh, type Object3D } from 'three';

/** A mesh that moves with a joint (0: stands with the base), in m in that joint's frame. */
export interface PlacedMesh {
  readonly joint: number;
  readonly geometry: BufferGeometry;
}

/** Every geometry below an object, in the object's coordinates. */
export function geometriesIn(object: Object3D): BufferGeometry[] {
  object.updateMatrixWorld(true);
  const found: BufferGeometry[] = [];
  object.traverse((part) => {
    if (part instanceof Mesh)
      found.push((part.geometry as BufferGeometry).clone().applyMatrix4(part.matrixWorld));
  });
  return found;
}
