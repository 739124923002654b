#pragma once

#include <string>

#include <CLI/CLI.hpp>

/// What is made from the tables of the command line itself, so that it cannot differ from them.
namespace flyball::app {

/// The manual page of the program and its commands, for man(1).
[[nodiscard]] std::string manual_page(const CLI::App& program);

/// Completion of commands, options and their values. @param shell  "bash", "zsh" or "fish".
[[nodiscard]] std::string completion(const CLI::App& program, const std::string& shell);

}  // namespace flyball::app
