# Installs the library, static and shared, and uses it from outside by CMake and by pkg-config.
# A sanitized library cannot be linked by a program that is not.
if(FATHOM_SANITIZE OR FATHOM_FUZZ)
    return()
endif()

function(fathom_consumer_test name)
    fathom_script_test(${name} consumer/run.sh ${ARGN})
    set_tests_properties(${name} PROPERTIES TIMEOUT 900)
endfunction()

foreach(kind static shared)
    set(prefix ${PROJECT_BINARY_DIR}/consumer/${kind})
    fathom_consumer_test(install_${kind} install ${PROJECT_BINARY_DIR} ${prefix} ${kind})
    set_tests_properties(install_${kind} PROPERTIES FIXTURES_SETUP installed_${kind} PROCESSORS 2)
    foreach(step cmake pkg-config readme symbols)
        fathom_consumer_test(consumer_${kind}_${step} ${step} ${PROJECT_BINARY_DIR} ${prefix})
        set_tests_properties(consumer_${kind}_${step} PROPERTIES FIXTURES_REQUIRED installed_${kind} RESOURCE_LOCK consumer_${kind})
    endforeach()
    if(TARGET fathom_cli)
        fathom_consumer_test(consumer_${kind}_program program ${PROJECT_BINARY_DIR} ${prefix})
        set_tests_properties(consumer_${kind}_program PROPERTIES FIXTURES_REQUIRED installed_${kind})
    endif()
endforeach()
