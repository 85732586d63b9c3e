// The boxes and cylinders of a URDF with edges that catch the light: broken by a share of their size.
import * as THREE from 'three';
import {RoundedBoxGeometry} from 'three/addons/geometries/RoundedBoxGeometry.js';
import {mergeGeometries} from 'three/addons/utils/BufferGeometryUtils.js';

const SHARE = 0.12, MOST = 0.006;  // of the smallest size, m
const AROUND = 32;                 // flats of a cylinder

const breadth = (...sizes) => Math.min(SHARE * Math.min(...sizes), MOST);

// About y, as of THREE.CylinderGeometry. Each line of the profile has normals of its own.
function cylinder(radius, length) {
  const b = breadth(radius, length), h = 0.5 * length;
  const profile = [[0, -h], [radius - b, -h], [radius, b - h], [radius, h - b], [radius - b, h], [0, h]].map(([r, y]) => new THREE.Vector2(r, y));
  return mergeGeometries(profile.slice(1).map((end, i) => new THREE.LatheGeometry([profile[i], end], AROUND)));
}

// `mesh`: as URDFLoader makes it, a shape of size 1 that is scaled.
export function breakEdges(mesh) {
  const {x, y, z} = mesh.scale, {type} = mesh.geometry;
  if (!(Math.min(x, y, z) > 0) || (type !== 'BoxGeometry' && type !== 'CylinderGeometry')) return;
  mesh.geometry.dispose();
  mesh.geometry = type === 'BoxGeometry' ? new RoundedBoxGeometry(x, y, z, 1, breadth(x, y, z)) : cylinder(x, y);
  mesh.scale.set(1, 1, 1);
}
