# An adapter outside assay's tree: builds engines/assay-engine-myengine.so against an installed assay.
#
#   cmake -S . -B build -DCMAKE_PREFIX_PATH=<where assay is installed> && cmake --build build
#   ASSAY_ENGINE_PATH=$PWD/build/engines assay list engines
cmake_minimum_required(VERSION 3.25)
project(assay-engine-myengine VERSION 0.1.0 LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_EXTENSIONS OFF)

find_package(assay REQUIRED)
# find_package(myengine REQUIRED), and its library among LIBRARIES
assay_add_engine(NAME myengine SOURCES engine.cc VERSION "${PROJECT_VERSION}" ORIGIN "built from source beside its adapter")
