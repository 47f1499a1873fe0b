#version 330
// Depth alone: for shadow maps, and for the room that hides people.
invariant gl_Position;
in vec3 in_position;
uniform mat4 view_projection;

void main() {
  gl_Position = view_projection * vec4(in_position, 1.0);
}
