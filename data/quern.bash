# SPDX-License-Identifier: MIT
# Completion of quern for bash: commands and options are what `--help` says.
_quern() {
	local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
	local command=${COMP_WORDS[1]}
	if [ "$COMP_CWORD" -eq 1 ]; then
		mapfile -t COMPREPLY < <(compgen -W "$(quern --help | sed -n 's/^  quern \([a-z_]*\).*/\1/p')" -- "$word")
	elif [[ $word == -* ]]; then
		mapfile -t COMPREPLY < <(compgen -W "$(quern "$command" --help | grep -o -- '--[a-z-]*')" -- "$word")
	elif [ "$command" = describe ]; then
		mapfile -t COMPREPLY < <(compgen -W "scene $(quern list | cut -d' ' -f1)" -- "$word")
	elif [ "$command" = new ] && [ "$before" = new ]; then
		mapfile -t COMPREPLY < <(compgen -W "$(quern list --all | cut -d. -f1 | sort -u)" -- "$word")
	else
		mapfile -t COMPREPLY < <(compgen -f -- "$word")
	fi
}
complete -o filenames -o bashdefault -F _quern quern
