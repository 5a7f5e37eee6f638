// Boom of a crane: a box girder of 6 m along x, tapered to its tip, walls of 12 mm. Metres; pins along z.
// Node sets FOOT and TIP: the ends; RAM: the plate below that the ram holds on to, at 2 m.
SetFactory("OpenCASCADE");
DefineConstant[ h = 0.12 ];
length = 6; wall = 0.012; wide = 0.26; high = 0.42; low = 0.22;
step = 1e-3;

// outer and inner tapered prisms
For k In {0:1}
  d = k*wall;
  p = newp;
  Point(p) = {0, -high/2 + d, -wide/2 + d}; Point(p + 1) = {length, -low/2 + d, -wide/2 + d};
  Point(p + 2) = {length, low/2 - d, -wide/2 + d}; Point(p + 3) = {0, high/2 - d, -wide/2 + d};
  l = newl;
  Line(l) = {p, p + 1}; Line(l + 1) = {p + 1, p + 2}; Line(l + 2) = {p + 2, p + 3}; Line(l + 3) = {p + 3, p};
  c = newll; Curve Loop(c) = {l, l + 1, l + 2, l + 3};
  s = news; Plane Surface(s) = {c};
  e() = Extrude {0, 0, wide - 2*d} { Surface{s}; };
  prisms[k] = e[1];
EndFor
girder() = BooleanDifference{ Volume{prisms[0]}; Delete; }{ Volume{prisms[1]}; Delete; };
v = newv; Box(v) = {1.85, -high/2 - 0.02, -0.06, 0.3, 0.1, 0.12};
whole() = BooleanUnion{ Volume{girder()}; Delete; }{ Volume{v}; Delete; };
Physical Volume("BODY") = {whole()};
foot() = Surface In BoundingBox {-step, -1, -1, step, 1, 1};
tip() = Surface In BoundingBox {length - step, -1, -1, length + step, 1, 1};
ram() = Surface In BoundingBox {1.8, -high/2 - 0.02 - step, -1, 2.2, -high/2 - 0.02 + step, 1};
Physical Surface("FOOT") = {foot()};
Physical Surface("TIP") = {tip()};
Physical Surface("RAM") = {ram()};
Mesh.CharacteristicLengthMin = h; Mesh.CharacteristicLengthMax = h;
