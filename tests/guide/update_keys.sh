#!/bin/sh
# update_keys.sh SIMFLEX: writes the guide's key reference anew.
set -eu
page=$(dirname "$0")/../../examples/guide/model_keys.md
{
    printf '# Keys of model files\n\n'
    printf '%s\n%s\n' 'Every key, as `simflex keys --markdown` prints it; [model files](model_file.md) explains how they are used.' \
        'Numbers may be formulas of parameters; NAME is a name of yours.'
    "$1" keys --markdown
} >"$page"
