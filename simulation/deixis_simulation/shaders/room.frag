#version 330
// A surface of the room.
in vec3 position;
in vec3 normal;
in vec2 coordinate;
in float part;
out vec4 colour;
uniform sampler2D albedo_map;
uniform vec3 tint;
uniform float roughness_of_surface;
uniform float gloss_of_surface;
uniform vec3 emission;

#include lighting.glsl

// An approximation of the sRGB curve.
vec3 linear(vec3 c) { return c * (c * (c * 0.3053 + 0.6822) + 0.0125); }

void main() {
  vec3 albedo = linear(texture(albedo_map, coordinate).rgb) * tint;
  vec3 n = normalize(normal);
  vec3 sum = shade(position, n, n, albedo, 0.0, roughness_of_surface, gloss_of_surface, 2.0) + emission;
  colour = vec4(clamp(sum, vec3(0.0), vec3(60.0)), 1.0);
}
