/** One arm as a set of three.js meshes. Sizes that no machine file tells (thickness, hand) are the drawing's own. */

import {
  BoxGeometry,
  type BufferGeometry,
  CylinderGeometry,
  Group,
  type Material,
  Matrix4,
  Mesh,
  Object3D,
  Quaternion,
  SphereGeometry,
  Vector3,
} from 'three';
import { BASE, framesOf, reachOf, type Chain, type Frame, type Vector } from './chain';
import { handPose } from './hand';
import type { PlacedMesh } from './geometries';

/** Sizes as shares of the arm's reach. */
const LINK_RADIUS = 0.042;
const BARREL_RADIUS = 0.066;
const BARREL_LENGTH = 0.17;
const BALL_RADIUS = 0.05;
const PALM = [0.05, 0.12, 0.06] as const;
const FINGER = [0.13, 0.022, 0.045] as const;
const SIDES = 24;

const UP = new Vector3(0, 1, 0);

/** Materials of a figure: one for every link, one for the rest. */
export interface FigureMaterials {
  readonly links: readonly Material[];
  readonly body: Material;
}

/** An arm that takes postures. `floor`: height (m) on which its column stands; null without a column. */
export class ArmFigure {
  readonly group = new Group();
  private readonly links: (Mesh | null)[];
  private readonly barrels: (Mesh | null)[];
  private readonly ball: Mesh;
  private readonly hand = new Group();
  private readonly fingers: Mesh[] = [];
  private readonly geometries: BufferGeometry[] = [];
  private readonly size: number;
  /** Of a URDF, by joint; 0: the base. */
  private readonly bodies = new Map<number, Group>();

  constructor(
    private readonly chain: Chain,
    private readonly materials: FigureMaterials,
    floor: number | null,
  ) {
    this.size = reachOf(chain) || 1;
    const link = this.kept(
      new CylinderGeometry(LINK_RADIUS * 0.8 * this.size, LINK_RADIUS * this.size, 1, SIDES),
    );
    const barrel = this.kept(
      new CylinderGeometry(
        BARREL_RADIUS * this.size,
        BARREL_RADIUS * this.size,
        BARREL_LENGTH * this.size,
        SIDES,
      ),
    );
    this.links = chain.map((joint, index) =>
      joint.a === 0 && joint.d === 0 && joint.revolute ? null : this.mesh(link, materials.links[index]!),
    );
    this.barrels = chain.map((_, index) =>
      index === 1 || (index > 1 && this.links[index - 1]) ? this.mesh(barrel, materials.body) : null,
    );
    this.ball = this.mesh(this.kept(new SphereGeometry(BALL_RADIUS * this.size, SIDES, 16)), materials.body);
    if (floor !== null && floor < 0) this.addColumn(floor);
    this.addHand();
  }

  /** Shows a posture: one value a joint, rad (m on a prismatic joint). */
  take(posture: readonly number[]): void {
    const frames = framesOf(this.chain, posture);
    this.bodies.forEach((body, joint) => body.matrix.copy(matrixOf(frames[joint - 1] ?? BASE)));
    this.links.forEach((link, index) => {
      if (link) stretch(link, originBefore(frames, index), frames[index]!.origin);
    });
    this.barrels.forEach((barrel, index) => {
      if (barrel) alignTo(barrel, frames[index - 1]!.origin, frames[index - 1]!.z);
    });
    const hand = handPose(this.chain, posture, frames);
    this.ball.position.set(...hand.origin);
    const forward = new Vector3(...hand.forward);
    const across = new Vector3(...hand.across);
    this.hand.setRotationFromMatrix(new Matrix4().makeBasis(forward, across, forward.clone().cross(across)));
    this.hand.position.set(...hand.origin);
  }

  /** Shows these in place of the plain arm. Their geometries remain the caller's. */
  wear(meshes: readonly PlacedMesh[]): void {
    this.group.clear();
    for (const { joint, geometry } of meshes) {
      const body = this.bodies.get(joint) ?? new Group();
      body.matrixAutoUpdate = false;
      body.add(new Mesh(geometry, this.materials.links[joint - 1] ?? this.materials.body));
      this.bodies.set(joint, body);
      this.group.add(body);
    }
  }

  /** Opens or closes the fingers. */
  grip(closed: boolean): void {
    const half = closed ? FINGER[1] / 2 : PALM[1] / 2;
    this.fingers.forEach((finger, index) => {
      finger.position.y = (index === 0 ? 1 : -1) * half * this.size;
    });
  }

  dispose(): void {
    this.geometries.forEach((geometry) => geometry.dispose());
    for (const material of new Set([...this.materials.links, this.materials.body])) material.dispose();
  }

  private addColumn(floor: number): void {
    const radius = BARREL_RADIUS * this.size;
    const column = this.mesh(
      this.kept(new CylinderGeometry(radius * 1.05, radius * 1.7, -floor, SIDES * 2)),
      this.materials.body,
    );
    alignTo(column, [0, 0, floor / 2], BASE.z);
    const ring = this.mesh(
      this.kept(new CylinderGeometry(radius * 1.22, radius * 1.22, radius * 0.5, SIDES * 2)),
      this.materials.links[0]!,
    );
    alignTo(ring, [0, 0, -radius * 1.5], BASE.z);
  }

  private addHand(): void {
    const scaled = (sizes: readonly [number, number, number]): BufferGeometry =>
      this.kept(new BoxGeometry(...(sizes.map((one) => one * this.size) as [number, number, number])));
    const palm = new Mesh(scaled(PALM), this.materials.links.at(-1)!);
    palm.position.x = (BALL_RADIUS + PALM[0] / 2) * this.size;
    this.hand.add(palm);
    const finger = scaled(FINGER);
    for (let count = 0; count < 2; count++) {
      const made = new Mesh(finger, this.materials.body);
      made.position.x = (BALL_RADIUS + PALM[0] + FINGER[0] / 2) * this.size;
      this.fingers.push(made);
      this.hand.add(made);
    }
    this.grip(false);
    this.group.add(this.hand);
  }

  private mesh(geometry: BufferGeometry, material: Material): Mesh {
    const made = new Mesh(geometry, material);
    this.group.add(made);
    return made;
  }

  private kept<T extends BufferGeometry>(geometry: T): T {
    this.geometries.push(geometry);
    return geometry;
  }
}

function originBefore(frames: readonly Frame[], index: number): Vector {
  return index === 0 ? BASE.origin : frames[index - 1]!.origin;
}

function matrixOf({ origin, x, y, z }: Frame): Matrix4 {
  return new Matrix4()
    .makeBasis(new Vector3(...x), new Vector3(...y), new Vector3(...z))
    .setPosition(new Vector3(...origin));
}

/** Puts a cylinder of length 1 between two points. */
function stretch(mesh: Object3D, from: Vector, to: Vector): void {
  const way = new Vector3(...to).sub(new Vector3(...from));
  const length = way.length();
  mesh.visible = length > 0;
  if (!mesh.visible) return;
  mesh.position.set((from[0] + to[0]) / 2, (from[1] + to[1]) / 2, (from[2] + to[2]) / 2);
  mesh.scale.y = length;
  mesh.quaternion.copy(new Quaternion().setFromUnitVectors(UP, way.divideScalar(length)));
}

/** Puts a cylinder's middle at a point, its axis along a unit vector. */
function alignTo(mesh: Object3D, at: Vector, axis: Vector): void {
  mesh.position.set(...at);
  mesh.quaternion.setFromUnitVectors(UP, new Vector3(...axis));
}
