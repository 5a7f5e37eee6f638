#!/bin/sh
# make_deck.sh GEO OUTPUT ELEMENT [GMSH OPTIONS…]: meshes GEO with Gmsh and writes a CalculiX deck.
#   OUTPUT             the deck: material, section, *INCLUDE of the mesh beside it (OUTPUT's name + _mesh.inp)
#   ELEMENT            element type of the solids: C3D8R, C3D8, C3D10 …
# The material is aluminium: 70 GPa, Poisson's ratio 0.3, 2700 kg/m³. Lengths in metres.
# Example: make_deck.sh crank.geo build/crank.inp C3D8R -setnumber h 0.002
set -eu
[ $# -ge 3 ] || { echo "usage: $0 GEO OUTPUT ELEMENT [GMSH OPTIONS…]" >&2; exit 2; }
geo=$1 deck=$2 element=$3
shift 3
mesh=${deck%.inp}_mesh.inp
trap 'rm -f "$mesh.new.inp"' EXIT
if ! log=$(gmsh -3 "$@" "$geo" -o "$mesh.new.inp" 2>&1) || printf '%s' "$log" | grep -q '^Error'; then
    printf '%s\n' "$log" >&2
    exit 1
fi
# Gmsh knows one brick; CalculiX has several.
sed "s/type=C3D[0-9]*,/type=$element,/" "$mesh.new.inp" > "$mesh"
cat > "$deck" <<DECK
*INCLUDE, INPUT=$(basename "$mesh")
*MATERIAL, NAME=ALUMINIUM
*ELASTIC
70E9, 0.3
*DENSITY
2700
*SOLID SECTION, ELSET=BODY, MATERIAL=ALUMINIUM
DECK
