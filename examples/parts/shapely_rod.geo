// Connecting rod with bearing bores, a tapered I-section shank and fillets, by Gmsh/OpenCASCADE in
// second-order tetrahedra (C3D10). Metres. Pins 180 mm apart along x, axes along z, big end at the
// origin. Node sets BIG_END and SMALL_END: the two bores.
// Element size: gmsh -setnumber h 0.0025 …

SetFactory("OpenCASCADE");
DefineConstant[ h = {0.0025, Name "Element size"} ];
mm = 0.001;
length = 180*mm;
thick = 10*mm;  // of the eyes and of the shank's flanges
web = 3*mm;     // thickness of the shank's web
bigOuter = 16*mm; bigBore = 10*mm;
smallOuter = 10*mm; smallBore = 6*mm;
eps = 0.01*mm;

// Eyes, their seams turned away from the shank.
Cylinder(1) = {0, 0, -thick/2, 0, 0, thick, bigOuter};
Cylinder(2) = {length, 0, -thick/2, 0, 0, thick, smallOuter};
Rotate {{0, 0, 1}, {0, 0, 0}, Pi} { Volume{1}; }

// Shank: a plate that tapers from 18 to 12 mm.
p = newp;
Point(p) = {0, -9*mm, -thick/2};
Point(p+1) = {length, -6*mm, -thick/2};
Point(p+2) = {length, 6*mm, -thick/2};
Point(p+3) = {0, 9*mm, -thick/2};
l = newl;
For i In {0:3}
  Line(l+i) = {p+i, p+(i+1)%4};
EndFor
loop = newll;
Curve Loop(loop) = {l:l+3};
face = news;
Plane Surface(face) = {loop};
plate[] = Extrude {0, 0, thick} { Surface{face}; };
rod[] = BooleanUnion{ Volume{1}; Delete; }{ Volume{2, plate[1]}; Delete; };

// Fillets along the four upright edges where shank and eyes meet.
uprights[] = {};
skin[] = Boundary{ Volume{rod[0]}; };
edges[] = Unique(Abs(Boundary{ Surface{skin[]}; }));
For i In {0:#edges[]-1}
  b[] = BoundingBox Curve{edges[i]};
  If (b[3]-b[0] < eps && b[4]-b[1] < eps && b[0] > 5*mm && b[0] < length - 5*mm)
    uprights[] += edges[i];
  EndIf
EndFor
rounded[] = Fillet{rod[0]}{uprights[]}{6*mm};

// Pockets on both faces leave the web of the I-section; their upright edges are round.
For side In {0:1}
  z = side ? web/2 : -thick;
  p = newp;
  Point(p) = {27*mm, -5.5*mm, z};
  Point(p+1) = {158*mm, -3.4*mm, z};
  Point(p+2) = {158*mm, 3.4*mm, z};
  Point(p+3) = {27*mm, 5.5*mm, z};
  l = newl;
  For i In {0:3}
    Line(l+i) = {p+i, p+(i+1)%4};
  EndFor
  loop = newll;
  Curve Loop(loop) = {l:l+3};
  face = news;
  Plane Surface(face) = {loop};
  pocket[] = Extrude {0, 0, thick - web/2} { Surface{face}; };
  walls[] = {};
  hull[] = Boundary{ Volume{pocket[1]}; };
  edges[] = Unique(Abs(Boundary{ Surface{hull[]}; }));
  For i In {0:#edges[]-1}
    b[] = BoundingBox Curve{edges[i]};
    If (b[3]-b[0] < eps && b[4]-b[1] < eps)
      walls[] += edges[i];
    EndIf
  EndFor
  round[] = Fillet{pocket[1]}{walls[]}{3*mm};
  // and so are the edges of its floor.
  hull[] = Boundary{ Volume{round[0]}; };
  edges[] = Unique(Abs(Boundary{ Surface{hull[]}; }));
  floor[] = {};
  For i In {0:#edges[]-1}
    b[] = BoundingBox Curve{edges[i]};
    If (b[2] > -web/2 - eps && b[5] < web/2 + eps)
      floor[] += edges[i];
    EndIf
  EndFor
  round[] = Fillet{round[0]}{floor[]}{2*mm};
  cut[] = BooleanDifference{ Volume{rounded[0]}; Delete; }{ Volume{round[0]}; Delete; };
  rounded[] = cut[];
EndFor

// Bearing bores.
v = newv;
Cylinder(v) = {0, 0, -thick, 0, 0, 2*thick, bigBore};
Cylinder(v+1) = {length, 0, -thick, 0, 0, 2*thick, smallBore};
part[] = BooleanDifference{ Volume{rounded[0]}; Delete; }{ Volume{v, v+1}; Delete; };

bigSeat[] = Surface In BoundingBox {-bigBore-eps, -bigBore-eps, -thick, bigBore+eps, bigBore+eps, thick};
smallSeat[] = Surface In BoundingBox {length-smallBore-eps, -smallBore-eps, -thick,
                                      length+smallBore+eps, smallBore+eps, thick};
Physical Volume("BODY") = {part[]};
Physical Surface("BIG_END") = {bigSeat[]};
Physical Surface("SMALL_END") = {smallSeat[]};

Mesh.CharacteristicLengthMin = 0.7*h;
Mesh.CharacteristicLengthMax = h;
Mesh.CharacteristicLengthFromCurvature = 1;
Mesh.MinimumElementsPerTwoPi = 12;
Mesh.ElementOrder = 2;
Mesh.Algorithm3D = 10;  // HXT
Mesh.HighOrderOptimize = 2;  // no element turned inside out by the curved skin
Mesh.SaveGroupsOfNodes = 1;
