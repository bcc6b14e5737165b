# Triangle meshes and their fields.
