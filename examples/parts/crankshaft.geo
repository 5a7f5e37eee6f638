// Crankshaft of a four-cylinder engine along z: five main journals, throws at +x, -x, -x, +x, a
// flange for the flywheel. Metres. Node sets MAIN_1, MAIN_3, MAIN_5, PIN_1 … PIN_4 and FLANGE.
SetFactory("OpenCASCADE");
DefineConstant[ h = 0.016 ];
throw = 0.045; journal = 0.025; pin = 0.022;             // radii
main_length = 0.024; web = 0.016; pin_length = 0.026;    // along z
pitch = main_length + 2*web + pin_length;
step = 1e-4;

sides[] = {1, -1, -1, 1};
volumes[] = {};
For i In {0:4}
  v = newv; Cylinder(v) = {0, 0, i*pitch - step, 0, 0, main_length + 2*step, journal}; volumes[] += v;
EndFor
For i In {0:3}
  side = sides[i]; z = i*pitch + main_length;
  v = newv; Cylinder(v) = {side*throw, 0, z + web - step, 0, 0, pin_length + 2*step, pin}; volumes[] += v;
  For k In {0:1}
    begin = z + k*(web + pin_length);
    // towards the pin, about the axis, and a counterweight beyond it
    v = newv; Cylinder(v) = {side*throw, 0, begin, 0, 0, web, 0.03}; volumes[] += v;
    v = newv; Box(v) = {side > 0 ? 0 : -throw, -0.03, begin, throw, 0.06, web}; volumes[] += v;
    v = newv; Cylinder(v) = {0, 0, begin, 0, 0, web, 0.034}; volumes[] += v;
    v = newv; Box(v) = {side > 0 ? -0.062 : 0.022, -0.042, begin, 0.04, 0.084, web}; volumes[] += v;
  EndFor
EndFor
v = newv; Cylinder(v) = {0, 0, 4*pitch + main_length, 0, 0, 0.012, 0.045}; volumes[] += v;
first = volumes[0]; others[] = volumes[]; others[] -= {first};
shaft() = BooleanUnion{ Volume{first}; Delete; }{ Volume{others[]}; Delete; };
Physical Volume("BODY") = {shaft()};

For i In {0:4:2}
  around[] = Surface In BoundingBox {-journal - step, -journal - step, i*pitch - 2*step,
                                     journal + step, journal + step, i*pitch + main_length + 2*step};
  Physical Surface(Sprintf("MAIN_%g", i + 1)) = {around[]};
EndFor
For i In {0:3}
  z = i*pitch + main_length + web;
  around[] = Surface In BoundingBox {sides[i]*throw - pin - step, -pin - step, z - 2*step,
                                     sides[i]*throw + pin + step, pin + step, z + pin_length + 2*step};
  Physical Surface(Sprintf("PIN_%g", i + 1)) = {around[]};
EndFor
z = 4*pitch + main_length + 0.012;
end[] = Surface In BoundingBox {-0.046, -0.046, z - step, 0.046, 0.046, z + step};
Physical Surface("FLANGE") = {end[]};
Mesh.CharacteristicLengthMin = h; Mesh.CharacteristicLengthMax = h;
