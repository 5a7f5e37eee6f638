// What the five casings of the stator share: bodies of revolution about the engine axis x (front at
// x = 0, y up), with lugs, bosses and bearing frames, by Gmsh/OpenCASCADE. Lengths below in
// millimetres, the mesh in metres. Second-order tetrahedra (C3D10).
// A casing is its filled outer shape with everything that is put on it, less its cavity and bores:
//   Call Outer;  { Call Lug; | Call Boss; }  Call Hollow;  [ Call BearingFrame; ]  Call Finish;
// Element size: gmsh -setnumber h 0.030 …

SetFactory("OpenCASCADE");
DefineConstant[ h = {0.040, Name "Element size"} ];
mm = 0.001;
eps = 0.01*mm;
core = 40;  // filled shapes leave this radius about the axis free
features[] = {};
bores[] = {};

// Closed polygon (px[], pr[]) turned about the axis: solid.
Macro Revolve
  p = newp;
  n = #px[];
  For k In {0:n-1}
    Point(p+k) = {px[k]*mm, pr[k]*mm, 0};
  EndFor
  l = newl;
  For k In {0:n-1}
    Line(l+k) = {p+k, p+(k+1)%n};
  EndFor
  loop = newll;
  Curve Loop(loop) = {l:l+n-1};
  face = news;
  Plane Surface(face) = {loop};
  revolved[] = Extrude {{1, 0, 0}, {0, 0, 0}, 2*Pi} { Surface{face}; };
  solid = revolved[1];
Return

// Outer contour (ox[], or[]), from front to rear: outer.
Macro Outer
  px[] = {ox[], ox[#ox[]-1], ox[0]};
  pr[] = {or[], core, core};
  Call Revolve;
  outer = solid;
Return

// Eye for a hinge: bore along x at radius lugEye and angle lugAngle from the top, on a plate that
// stands on the casing from lugX to lugX + lugThick.
Macro Lug
  p = newp;
  Point(p) = {lugX*mm, lugBase*mm, -lugWidth/2*mm};
  Point(p+1) = {lugX*mm, lugBase*mm, lugWidth/2*mm};
  Point(p+2) = {lugX*mm, lugEye*mm, 0.98*lugOuter*mm};
  Point(p+3) = {lugX*mm, lugEye*mm, -0.98*lugOuter*mm};
  l = newl;
  For k In {0:3}
    Line(l+k) = {p+k, p+(k+1)%4};
  EndFor
  loop = newll;
  Curve Loop(loop) = {l:l+3};
  face = news;
  Plane Surface(face) = {loop};
  plate[] = Extrude {lugThick*mm, 0, 0} { Surface{face}; };
  v = newv;
  Cylinder(v) = {lugX*mm, lugEye*mm, 0, lugThick*mm, 0, 0, lugOuter*mm};
  Cylinder(v+1) = {(lugX-10)*mm, lugEye*mm, 0, (lugThick+20)*mm, 0, 0, lugBore*mm};
  Rotate {{1, 0, 0}, {0, 0, 0}, lugAngle} { Volume{plate[1], v, v+1}; }
  features[] += {plate[1], v};
  bores[] += {v+1};
Return

// Round boss with a radial port: at bossX and bossAngle from the top, up to radius bossTop.
Macro Boss
  v = newv;
  Cylinder(v) = {bossX*mm, 200*mm, 0, 0, (bossTop-200)*mm, 0, bossOuter*mm};
  Cylinder(v+1) = {bossX*mm, 190*mm, 0, 0, (bossTop-170)*mm, 0, bossBore*mm};
  Rotate {{1, 0, 0}, {0, 0, 0}, bossAngle} { Volume{v, v+1}; }
  features[] += {v};
  bores[] += {v+1};
Return

// Takes the cavity with contour (ix[], ir[]), which ends beyond the casing, and the bores away: body[].
Macro Hollow
  If (#features[] > 0)
    joined[] = BooleanUnion{ Volume{outer}; Delete; }{ Volume{features[]}; Delete; };
  Else
    joined[] = {outer};
  EndIf
  px[] = {ix[], ix[#ix[]-1], ix[0]};
  pr[] = {ir[], core-10, core-10};
  Call Revolve;
  body[] = BooleanDifference{ Volume{joined[]}; Delete; }{ Volume{solid, bores[]}; Delete; };
Return

// Hub for a rotor bearing from hubX to hubX + hubLength, carried by strutCount struts that end in
// the wall of thickness wall.
Macro BearingFrame
  px[] = {ix[], ix[#ix[]-1], ix[0]};
  pr[] = {};
  For k In {0:#ir[]-1}
    pr[] += ir[k] + wall/2;
  EndFor
  pr[] += {core-10, core-10};
  Call Revolve;
  limit = solid;
  struts[] = {};
  middle = hubX + hubLength/2;
  For j In {0:strutCount-1}
    p = newp;
    foot = (hubBore + hubOuter)/2*mm;
    Point(p) = {(middle-strutChord/2)*mm, foot, 0};
    Point(p+1) = {(middle-strutChord/4)*mm, foot, -strutThick/2*mm};
    Point(p+2) = {(middle+strutChord/4)*mm, foot, -strutThick/2*mm};
    Point(p+3) = {(middle+strutChord/2)*mm, foot, 0};
    Point(p+4) = {(middle+strutChord/4)*mm, foot, strutThick/2*mm};
    Point(p+5) = {(middle-strutChord/4)*mm, foot, strutThick/2*mm};
    l = newl;
    For k In {0:5}
      Line(l+k) = {p+k, p+(k+1)%6};
    EndFor
    loop = newll;
    Curve Loop(loop) = {l:l+5};
    face = news;
    Plane Surface(face) = {loop};
    strut[] = Extrude {0, 500*mm, 0} { Surface{face}; };
    Rotate {{1, 0, 0}, {0, 0, 0}, 2*Pi*(j + 0.5)/strutCount} { Volume{strut[1]}; }
    struts[] += strut[1];
  EndFor
  struts[] = BooleanIntersection{ Volume{struts[]}; Delete; }{ Volume{limit}; Delete; };
  v = newv;
  Cylinder(v) = {hubX*mm, 0, 0, hubLength*mm, 0, 0, hubOuter*mm};
  joined[] = BooleanUnion{ Volume{v}; Delete; }{ Volume{struts[]}; Delete; };
  v = newv;
  Cylinder(v) = {(hubX-1)*mm, 0, 0, (hubLength+2)*mm, 0, 0, hubBore*mm};
  frame[] = BooleanDifference{ Volume{joined[]}; Delete; }{ Volume{v}; Delete; };
  body[] = BooleanUnion{ Volume{body[]}; Delete; }{ Volume{frame[]}; Delete; };
  r = hubBore*mm + eps;
  seat[] = Surface In BoundingBox {hubX*mm-eps, -r, -r, (hubX+hubLength)*mm+eps, r, r};
  Physical Surface("BEARING") = {seat[]};
Return

// Node sets of the flanges' faces at x = frontFace and rearFace (left out where negative), the mesh.
Macro Finish
  Physical Volume("BODY") = {body[]};
  If (frontFace >= 0)
    faces[] = Surface In BoundingBox {frontFace*mm-eps, -1, -1, frontFace*mm+eps, 1, 1};
    Physical Surface("FRONT") = {faces[]};
  EndIf
  If (rearFace >= 0)
    faces[] = Surface In BoundingBox {rearFace*mm-eps, -1, -1, rearFace*mm+eps, 1, 1};
    Physical Surface("REAR") = {faces[]};
  EndIf
Return

// Node set of the bore of the lug made last.
Macro LugSeat
  y = lugEye*Cos(lugAngle)*mm;
  z = lugEye*Sin(lugAngle)*mm;
  r = lugBore*mm + eps;
  seat[] = Surface In BoundingBox {lugX*mm-eps, y-r, z-r, (lugX+lugThick)*mm+eps, y+r, z+r};
Return

Mesh.CharacteristicLengthMax = h;
Mesh.CharacteristicLengthFromCurvature = 1;
Mesh.MinimumElementsPerTwoPi = 9;
Mesh.ElementOrder = 2;
Mesh.Algorithm3D = 1;  // Delaunay: as good as HXT in thin walls, and many times faster
Mesh.HighOrderOptimize = 2;  // no element turned inside out by the curved skin
Mesh.SaveGroupsOfNodes = 1;
