// A prismatic bar of brick elements between two pin seats: the pattern of crank.geo and rod.geo.
// The including file sets, in metres: length (between the pins), width, thickness, overhang,
// seat (side of the square core that a pin holds), first and second (names of the two seats).
// Element size: gmsh -setnumber h 0.002 …

DefineConstant[ h = {0.001, Name "Element size"} ];

xs[] = {-overhang, -seat/2, seat/2, length - seat/2, length + seat/2, length + overhang};
ys[] = {-width/2, -seat/2, seat/2, width/2};

For j In {0:3}
  For i In {0:5}
    Point(1 + i + 6*j) = {xs[i], ys[j], -thickness/2};
  EndFor
EndFor

For j In {0:3}
  For i In {0:4}
    Line(100 + i + 5*j) = {1 + i + 6*j, 2 + i + 6*j};
    Transfinite Curve{100 + i + 5*j} = 1 + Max(1, Round((xs[i+1] - xs[i])/h));
  EndFor
EndFor
For j In {0:2}
  For i In {0:5}
    Line(200 + i + 6*j) = {1 + i + 6*j, 7 + i + 6*j};
    Transfinite Curve{200 + i + 6*j} = 1 + Max(1, Round((ys[j+1] - ys[j])/h));
  EndFor
EndFor

For j In {0:2}
  For i In {0:4}
    face = 300 + i + 5*j;
    Curve Loop(face) = {100 + i + 5*j, 201 + i + 6*j, -(105 + i + 5*j), -(200 + i + 6*j)};
    Plane Surface(face) = {face};
    Transfinite Surface{face};
    Recombine Surface{face};
  EndFor
EndFor

body[] = {};
For k In {0:14}
  block[] = Extrude {0, 0, thickness} {
    Surface{300 + k}; Layers{ Max(1, Round(thickness/h)) }; Recombine;
  };
  body[] += block[1];
EndFor

Physical Volume("BODY") = {body[]};
Physical Volume(Str(first)) = {body[6]};
Physical Volume(Str(second)) = {body[8]};
Mesh.SaveGroupsOfNodes = 1;
