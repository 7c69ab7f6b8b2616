import { Box3, BoxGeometry, Group, Mesh, MeshBasicMaterial, Object3D, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { framesOf, type Chain } from './chain';
import { ArmFigure } from './figure';
import { geometriesIn } from './geometries';

const CHAIN: Chain = [
  { name: 'pan', revolute: true, a: 0, alpha: Math.PI / 2, d: 0.3, theta: 0 },
  { name: 'lift', revolute: true, a: 0.5, alpha: 0, d: 0, theta: 0.2 },
];

function middle(object: Object3D): number[] {
  object.updateMatrixWorld(true);
  return new Box3().setFromObject(object).getCenter(new Vector3()).toArray();
}

describe('meshes', () => {
  it('have the place that their file gives them, however deep', () => {
    const part = new Mesh(new BoxGeometry(1, 1, 1));
    part.position.set(0, 0, 1);
    const whole = new Group().add(new Group().add(part));
    whole.children[0]!.scale.setScalar(0.001);
    const [geometry] = geometriesIn(whole);
    geometry!.computeBoundingBox();
    expect(geometry!.boundingBox!.getCenter(new Vector3()).z).toBeCloseTo(0.001);
    expect(part.geometry.boundingBox).toBeNull(); // the file's own stays as it was
  });

  it('move with their joints in place of the plain arm', () => {
    const material = new MeshBasicMaterial();
    const figure = new ArmFigure(CHAIN, { links: [material, material], body: material }, -0.5);
    figure.wear([0, 1, 2].map((joint) => ({ joint, geometry: new BoxGeometry(0.1, 0.1, 0.1) })));
    expect(figure.group.children).toHaveLength(3);
    for (const posture of [
      [0, 0],
      [1, -0.7],
    ]) {
      figure.take(posture);
      const origins = [[0, 0, 0], ...framesOf(CHAIN, posture).map(({ origin }) => origin)];
      figure.group.children.forEach((body, index) =>
        middle(body).forEach((value, axis) => expect(value).toBeCloseTo(origins[index]![axis]!)),
      );
    }
  });
});
