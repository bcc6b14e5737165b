# Warnings, float semantics and sanitizers that every target of the project shares.
add_library(fathom_flags INTERFACE)
target_compile_options(fathom_flags INTERFACE
    -Wall -Wextra -Wpedantic -Wshadow -Wpointer-arith -Wwrite-strings -Wvla
    "$<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes;-Wmissing-prototypes>"
    # Sums are rounded one by one, so that every backend gives the same bits.
    -ffp-contract=off)
target_compile_definitions(fathom_flags INTERFACE _GNU_SOURCE _FILE_OFFSET_BITS=64)
if(FATHOM_WERROR)
    target_compile_options(fathom_flags INTERFACE -Werror)
endif()
if(FATHOM_SANITIZE)
    target_compile_options(fathom_flags INTERFACE -fsanitize=${FATHOM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(fathom_flags INTERFACE -fsanitize=${FATHOM_SANITIZE})
endif()
if(FATHOM_FUZZ)
    target_compile_options(fathom_flags INTERFACE -fsanitize=fuzzer-no-link)
    target_link_options(fathom_flags INTERFACE -fsanitize=fuzzer-no-link)
endif()
