//! `trajc completions SHELL`: the completion script of a shell.

use clap_complete::Shell;

/// The completion script for `command`, to be sourced by `shell`.
pub fn text(shell: Shell, command: &mut clap::Command) -> String {
    let name = command.get_name().to_string();
    let mut script = Vec::new();
    clap_complete::generate(shell, command, name, &mut script);
    // Names and help texts are ours and UTF-8; lossy so that nothing here can fail.
    String::from_utf8_lossy(&script).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shell_gets_a_script_that_names_the_subcommands() {
        for shell in [Shell::Bash, Shell::Elvish, Shell::Fish, Shell::PowerShell, Shell::Zsh] {
            let mut command = clap::Command::new("trajc").subcommand(clap::Command::new("path-error"));
            let script = text(shell, &mut command);
            assert!(script.contains("trajc") && script.contains("path-error"), "{shell}");
        }
    }
}
