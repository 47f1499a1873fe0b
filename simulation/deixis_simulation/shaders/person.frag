#version 330
// The light on what body.frag has left; alpha 1 where there is a person.
out vec4 colour;
uniform sampler2D albedo_map;
uniform sampler2D normal_map;
uniform sampler2D flat_map;
uniform sampler2D position_map;

#include lighting.glsl

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 position = texelFetch(position_map, at, 0);
  if (position.w < 0.5) { colour = vec4(0.0); return; }
  vec4 albedo = texelFetch(albedo_map, at, 0);
  vec4 n = texelFetch(normal_map, at, 0);
  bool eye = n.w > 0.5;
  float skin = eye ? 0.0 : albedo.w;
  float roughness = eye ? 0.12 : mix(0.75, 0.47, skin);
  float gloss = eye ? 1.6 : mix(0.25, 0.8, skin);
  vec3 sum = shade(position.xyz, n.xyz, texelFetch(flat_map, at, 0).xyz, albedo.rgb, skin, roughness, gloss, 4.0);
  colour = vec4(clamp(sum, vec3(0.0), vec3(60.0)), 1.0);
}
