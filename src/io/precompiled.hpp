#pragma once

// Of the sources that read, write and print: what most of them include beside what all include.

#include <filesystem>
#include <fstream>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/precompiled.hpp"
