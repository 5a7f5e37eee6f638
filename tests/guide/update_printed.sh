#!/bin/sh
# update_printed.sh SIMFLEX: writes anew what the guide has from the program: the key reference, the prompt's commands.
set -eu
simflex=$(realpath "$1")
cd "$(dirname "$0")/../../examples/guide"
{
    printf '# Keys of model files\n\n'
    # shellcheck disable=SC2016 # Markdown's code
    printf '%s\n%s\n' 'Every key, as `simflex keys --markdown` prints it; [model files](model_file.md) explains how they are used.' \
        'Numbers may be formulas of parameters; NAME is a name of yours.'
    "$simflex" keys --markdown
} >model_keys.md.new
mv model_keys.md.new model_keys.md
{
    sed '/^## Commands$/q' prompt.md
    echo
    "$simflex" shell -q -c 'help --markdown'
} >prompt.md.new
mv prompt.md.new prompt.md
