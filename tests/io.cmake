# Tests of reading and writing files.
fathom_test(io_roundtrip io_roundtrip.c)
