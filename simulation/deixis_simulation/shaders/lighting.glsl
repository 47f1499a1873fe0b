// Linear light from many lamps with shadow maps in one atlas of 4 x 4 tiles; key lamps also shine. Included by room.frag, person.frag.
uniform sampler2DShadow shadow_map;
uniform int lamps;
uniform int key_lamps;
uniform vec3 lamp_position[16];
uniform vec3 lamp_colour[16];
uniform mat4 lamp_matrix[16];
uniform float lamp_softness[16];
uniform float lamp_reach2[16];
uniform vec3 camera;
uniform vec3 ambient_up;
uniform vec3 ambient_down;
uniform vec2 jitter;
uniform float shadow_raise;  // metres along the normal, so that a surface does not shade itself

// Interleaved gradient noise: the soft shadow's taps turn from pixel to pixel, and several passes with other jitter average it.
float noise(vec2 at) { return fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715)))); }

float lit(int lamp, vec4 at, vec2 turn, float taps) {
  vec4 clip = lamp_matrix[lamp] * at;
  vec3 place = clip.xyz / clip.w;
  float outward = max(abs(place.x), abs(place.y));
  if (clip.w <= 0.0 || outward >= 0.985 || abs(place.z) >= 1.0) return 1.0;
  float fading = smoothstep(0.85, 0.985, outward);  // the end of the map is no edge in the picture
  place = clamp(place * 0.5 + 0.5, 0.012, 0.988);
  vec2 tile = vec2(float(lamp & 3), float(lamp >> 2)) * 0.25;
  vec2 offset = turn * lamp_softness[lamp];
  float depth = place.z - 0.0015;
  float first = texture(shadow_map, vec3(tile + clamp(place.xy + offset, 0.01, 0.99) * 0.25, depth));
  if (taps > 1.5) {
    first = 0.5 * (first + texture(shadow_map, vec3(tile + clamp(place.xy - offset * 0.7, 0.01, 0.99) * 0.25, depth)));
  }
  if (taps > 3.5) {  // across as well: on people, rendered once, the turning of two taps shows as a pattern
    vec2 across = vec2(-offset.y, offset.x) * 0.85;
    float third = texture(shadow_map, vec3(tile + clamp(place.xy + across, 0.01, 0.99) * 0.25, depth));
    float fourth = texture(shadow_map, vec3(tile + clamp(place.xy - across, 0.01, 0.99) * 0.25, depth));
    first = 0.5 * first + 0.25 * (third + fourth);
  }
  return mix(first, 1.0, fading);
}

float reach(int lamp, float d2) { return min(lamp_reach2[lamp] / d2, 3.0); }

vec3 ambient(vec3 n) { return mix(ambient_down, ambient_up, n.y * 0.5 + 0.5); }

// What is left of the ambient light where `seen` of the lamps' lights fall.
float occlusion(float seen) { return 0.35 + 0.65 * seen / float(max(lamps, 1)); }

// Light from `position` to the camera; n is the bumped normal, flat_normal that of the mesh; skin is 0 to 1; taps: 2 or 4 a key lamp.
vec3 shade(vec3 position, vec3 n, vec3 flat_normal, vec3 albedo, float skin, float roughness, float gloss, float taps) {
  vec3 to_camera = normalize(camera - position);
  float angle = noise(gl_FragCoord.xy + jitter) * 6.2831853;
  vec2 turn = vec2(cos(angle), sin(angle));
  vec4 raised = vec4(position + flat_normal * shadow_raise, 1.0);
  float facing = max(dot(n, to_camera), 0.05);
  float a2 = roughness * roughness * roughness * roughness;
  float k = roughness * roughness * 0.5;
  // Light wraps around skin, red most: it scatters under the surface.
  vec3 wrap = vec3(0.28, 0.10, 0.06) * skin;
  vec3 scale_wrap = 1.0 / ((1.0 + wrap) * (1.0 + wrap));
  vec3 mixed = mix(vec3(1.0), vec3(0.35, 0.75, 1.0), skin);
  vec3 diffuse = vec3(0.0), shine = vec3(0.0);
  float seen = 0.0;
  for (int i = 0; i < lamps; i++) {
    vec3 l = lamp_position[i] - position;
    float d2 = dot(l, l);
    l *= inversesqrt(d2);
    bool key = i < key_lamps;
    float s = lit(i, raised, turn, key ? taps : 0.5 * taps);
    seen += s;
    vec3 light = lamp_colour[i] * (key ? reach(i, d2) : 1.0);
    float nl = dot(n, l);
    vec3 cosine = mix(vec3(dot(flat_normal, l)), vec3(nl), mixed);
    float edge = s * (1.0 - s) * skin;
    diffuse += light * clamp((cosine + wrap) * scale_wrap, 0.0, 1.0) * vec3(s + 0.3 * edge, s, s - 0.08 * edge);
    if (!key) continue;
    vec3 h = normalize(l + to_camera);
    float nh = max(dot(n, h), 0.0);
    float spread = nh * nh * (a2 - 1.0) + 1.0;
    float grazing = 1.0 - max(dot(to_camera, h), 0.0);
    float fresnel = 0.028 + 0.97 * grazing * grazing * grazing * grazing * grazing;
    nl = max(nl, 0.0);
    float lobe = a2 * fresnel / (12.566 * spread * spread * (nl * (1.0 - k) + k + 1e-3) * (facing * (1.0 - k) + k));
    shine += light * (s * nl * gloss * min(lobe, 4.0));
  }
  vec3 around = ambient(n) * occlusion(seen);
  float rim = 1.0 - max(dot(n, to_camera), 0.0);
  rim *= rim;
  rim *= rim;
  return albedo * (diffuse + around) + shine * 0.9 + around * rim * 0.10 * gloss;
}
