fathom_test(transform_args transform_args.c)
fathom_test(transform_oracle transform_oracle.c cases.c)
fathom_test(transform_big transform_big.c)
