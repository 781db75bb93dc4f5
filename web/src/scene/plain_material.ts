// A material for software rasterisers (SwiftShader, llvmpipe), whose time goes into the fragment
// shader. It looks like MeshLambertMaterial without shadows at a fraction of the cost: light is
// computed per vertex, and the sRGB curves are approximated.
import * as THREE from "three";

// Texels of one matrix in the texture `places` (crowd.ts)
export const kTexels = 4;

// Irradiance at a vertex
const kLightOn = /* glsl */ `
vec3 lightOn(vec3 normal, vec3 position) {
  vec3 irradiance = ambientLightColor;
  #if NUM_HEMI_LIGHTS > 0
  for (int i = 0; i < NUM_HEMI_LIGHTS; ++i)
    irradiance += getHemisphereLightIrradiance(hemisphereLights[i], normal);
  #endif
  #if NUM_DIR_LIGHTS > 0
  for (int i = 0; i < NUM_DIR_LIGHTS; ++i)
    irradiance += max(0.0, dot(normal, directionalLights[i].direction)) * directionalLights[i].color;
  #endif
  IncidentLight light;
  #if NUM_POINT_LIGHTS > 0
  for (int i = 0; i < NUM_POINT_LIGHTS; ++i) {
    getPointLightInfo(pointLights[i], position, light);
    irradiance += max(0.0, dot(normal, light.direction)) * light.color;
  }
  #endif
  #if NUM_SPOT_LIGHTS > 0
  for (int i = 0; i < NUM_SPOT_LIGHTS; ++i) {
    getSpotLightInfo(spotLights[i], position, light);
    irradiance += max(0.0, dot(normal, light.direction)) * light.color;
  }
  #endif
  return RECIPROCAL_PI * irradiance;
}
`;

const kVertex = /* glsl */ `
varying vec3 vLight;
#ifdef DOUBLE_SIDED
varying vec3 vLightBehind;
#endif
#ifdef COPIES
uniform highp sampler2D places;
attribute float copy;
#endif
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <clipping_planes_pars_vertex>
#include <lights_pars_begin>
${kLightOn}
void main() {
  #include <uv_vertex>
  #include <color_vertex>
  #include <beginnormal_vertex>
  #include <begin_vertex>
  #ifdef COPIES
  ivec2 at = ivec2(${kTexels} * int(copy), gl_InstanceID);
  mat4 place = mat4(texelFetch(places, at, 0), texelFetch(places, at + ivec2(1, 0), 0),
    texelFetch(places, at + ivec2(2, 0), 0), texelFetch(places, at + ivec2(3, 0), 0));
  objectNormal = mat3(place) * objectNormal;
  transformed = (place * vec4(transformed, 1.0)).xyz;
  #endif
  #include <defaultnormal_vertex>
  #include <project_vertex>
  #include <clipping_planes_vertex>
  #include <fog_vertex>
  vec3 facing = normalize(transformedNormal);
  vLight = lightOn(facing, mvPosition.xyz);
  #ifdef DOUBLE_SIDED
  vLightBehind = lightOn(-facing, mvPosition.xyz);
  #endif
}
`;

// The sRGB curve by square roots, and its inverse by a polynomial (Ian Taylor, "sRGB approximations
// for HLSL", chilliant.blogspot.com, 2012): errors up to 0.0005, and 0.01 near black.
const kColours = /* glsl */ `
vec3 encoded(vec3 linear) {
  vec3 s1 = sqrt(linear), s2 = sqrt(s1), s3 = sqrt(s2);
  return 0.662002687 * s1 + 0.684122060 * s2 - 0.323583601 * s3 - 0.0225411470 * linear;
}
vec3 decoded(vec3 c) { return c * (c * (c * 0.305306011 + 0.682171111) + 0.012522878); }
`;
const kMap = /* glsl */ `
#ifdef USE_MAP
  vec4 texel = texture2D(map, vMapUv);
  diffuseColor *= vec4(decoded(texel.rgb), texel.a);
#endif
`;
const kEncode = "gl_FragColor.rgb = encoded(gl_FragColor.rgb);";

const kFragment = /* glsl */ `
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
varying vec3 vLight;
#ifdef DOUBLE_SIDED
varying vec3 vLightBehind;
#endif
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphatest_pars_fragment>
#include <fog_pars_fragment>
#include <clipping_planes_pars_fragment>
${kColours}
void main() {
  vec4 diffuseColor = vec4(diffuse, opacity);
  #include <clipping_planes_fragment>
  ${kMap}
  #include <color_fragment>
  #include <alphatest_fragment>
  vec3 light = vLight;
  #ifdef DOUBLE_SIDED
  if (!gl_FrontFacing) light = vLightBehind;
  #endif
  vec3 outgoingLight = diffuseColor.rgb * light + emissive;
  #include <opaque_fragment>
  #include <tonemapping_fragment>
  ${kEncode}
  #include <fog_fragment>
}
`;

// One shader if the world has lamps, another if it has none.
const either = (lamps: string, none: string) =>
  `#if (NUM_POINT_LIGHTS + NUM_SPOT_LIGHTS) > 0\n${lamps}\n#else\n${none}\n#endif\n`;

// A map is sampled as stored, in sRGB: its colorSpace must be NoColorSpace. places: the matrices of
// a crowd. Its copies are small, so that even lamps are computed per vertex; on large surfaces a
// lamp is brighter in the middle than at the corners, and is computed per pixel.
export function plainMaterial(
  parameters: THREE.MeshLambertMaterialParameters,
  places: THREE.Texture | null = null,
): THREE.MeshLambertMaterial {
  const material = new THREE.MeshLambertMaterial(parameters);
  if (places) material.defines = { COPIES: "" };
  material.onBeforeCompile = (shader) => {
    if (places) {
      shader.uniforms.places = { value: places };
      shader.vertexShader = kVertex;
      shader.fragmentShader = kFragment;
      return;
    }
    const byPixel = shader.fragmentShader
      .replace("void main()", `${kColours}\nvoid main()`)
      .replace("#include <map_fragment>", kMap)
      .replace("#include <colorspace_fragment>", kEncode);
    shader.vertexShader = either(shader.vertexShader, kVertex);
    shader.fragmentShader = either(byPixel, kFragment);
  };
  material.customProgramCacheKey = () => (places ? "plain copies" : "plain");
  return material;
}
