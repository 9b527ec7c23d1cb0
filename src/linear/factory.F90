! SPDX-License-Identifier: MIT
!> Creates solvers by name.
module rockdda_linear_factory
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_strings, only : to_string
   use rockdda_linear_solver, only : linear_solver_type
   use rockdda_linear_dense, only : dense_solver_type
   use rockdda_linear_block_cholesky, only : new_block_cholesky, most_blocks
   use rockdda_linear_sor, only : sor_solver_type
   use rockdda_linear_pcg, only : pcg_solver_type
   use rockdda_linear_auto, only : auto_solver_type
#ifdef ROCKDDA_WITH_CHOLMOD
   use rockdda_linear_cholmod, only : cholmod_solver_type
#endif
   implicit none
   private
   public :: new_solver, solver_names, has_cholmod, default_solver

   !> Names that `new_solver` accepts.
   character(len=*), parameter :: solver_names = 'auto, cholmod, pcg, sor, dense'

contains

   !> Was CHOLMOD built in?
   pure logical function has_cholmod()
      has_cholmod = .false.
#ifdef ROCKDDA_WITH_CHOLMOD
      has_cholmod = .true.
#endif
   end function has_cholmod

   !> The default solver.
   pure function default_solver() result(name)
      character(len=:), allocatable :: name
      name = 'auto'
   end function default_solver

   !> Create the solver of a name.
   subroutine new_solver(name, tolerance, omega, preconditioner, solver, error)
      character(len=*), intent(in) :: name            !! one of `solver_names`
      real(wp), intent(in) :: tolerance               !! wanted relative residual, > 0
      real(wp), intent(in) :: omega                   !! factor of SOR, 0 < omega < 2
      character(len=*), intent(in) :: preconditioner  !! of an iterative solver; blank: its default
      class(linear_solver_type), allocatable, intent(out) :: solver
      type(error_type), allocatable, intent(out) :: error

      if (.not. tolerance > 0) then
         call make_error(error, error_code%input, 'solver tolerance must be positive, not '//to_string(tolerance))
         return
      end if
      if (.not. (omega > 0 .and. omega < 2)) then
         call make_error(error, error_code%input, 'SOR factor must be between 0 and 2, not '//to_string(omega))
         return
      end if
      if (len_trim(preconditioner) > 0 .and. name /= 'pcg' .and. name /= 'auto') then
         call make_error(error, error_code%input, "solver '"//trim(name)//"' takes no preconditioner")
         return
      end if
      select case (trim(name))
      case ('cholmod')
         call new_cholmod(tolerance, solver, error)
      case ('auto')
         call new_auto(tolerance, preconditioner, solver, error)
      case ('pcg')
         call new_pcg(tolerance, preconditioner, solver, error)
      case ('dense')
         allocate (solver, source=dense_solver_type(tolerance=tolerance))
      case ('sor')
         allocate (solver, source=sor_solver_type(tolerance=tolerance, omega=omega))
      case default
         call make_error(error, error_code%input, "unknown solver '"//trim(name)//"', expected one of "//solver_names)
      end select
   end subroutine new_solver

   !> PCG with the preconditioner of a name.
   subroutine new_pcg(tolerance, preconditioner, solver, error)
      real(wp), intent(in) :: tolerance
      character(len=*), intent(in) :: preconditioner   !! blank: ic0
      class(linear_solver_type), allocatable, intent(out) :: solver
      type(error_type), allocatable, intent(out) :: error
      type(pcg_solver_type), allocatable :: pcg
      allocate (pcg)
      pcg%tolerance = tolerance
      call set_preconditioner(pcg, preconditioner, error)
      if (.not. allocated(error)) call move_alloc(pcg, solver)
   end subroutine new_pcg

   !> Choose the preconditioner of PCG by its name.
   subroutine set_preconditioner(pcg, preconditioner, error)
      type(pcg_solver_type), intent(inout) :: pcg
      character(len=*), intent(in) :: preconditioner   !! blank: its default
      type(error_type), allocatable, intent(out) :: error
      logical :: known
      if (len_trim(preconditioner) == 0) return
      call pcg%preconditioner%choose(trim(preconditioner), known)
      if (.not. known) call make_error(error, error_code%input, "unknown preconditioner '"//trim(preconditioner)// &
                                       "', expected one of jacobi, ssor, ic0")
   end subroutine set_preconditioner

   !> The automatic choice between PCG and a direct solver: CHOLMOD if it is built in.
   subroutine new_auto(tolerance, preconditioner, solver, error)
      real(wp), intent(in) :: tolerance
      character(len=*), intent(in) :: preconditioner   !! of PCG, blank: its default
      class(linear_solver_type), allocatable, intent(out) :: solver
      type(error_type), allocatable, intent(out) :: error
      type(auto_solver_type), allocatable :: auto
      allocate (auto)
      auto%pcg%tolerance = tolerance
      call set_preconditioner(auto%pcg, preconditioner, error)
      if (allocated(error)) return
#ifdef ROCKDDA_WITH_CHOLMOD
      allocate (cholmod_solver_type :: auto%direct)
      auto%direct%tolerance = tolerance
      allocate (auto%other, source=new_block_cholesky(tolerance))
#else
      allocate (auto%direct, source=new_block_cholesky(tolerance))
      auto%direct_limit = most_blocks
#endif
      call move_alloc(auto, solver)
   end subroutine new_auto

   !> CHOLMOD, or an error that names the option to build with.
   subroutine new_cholmod(tolerance, solver, error)
      real(wp), intent(in) :: tolerance
      class(linear_solver_type), allocatable, intent(inout) :: solver  !! unallocated when not built in
      type(error_type), allocatable, intent(out) :: error
#ifdef ROCKDDA_WITH_CHOLMOD
      type(cholmod_solver_type), allocatable :: cholmod
      allocate (cholmod)
      cholmod%tolerance = tolerance
      call move_alloc(cholmod, solver)
#else
      associate (unused => tolerance)
      end associate
      if (allocated(solver)) deallocate (solver)
      call make_error(error, error_code%input, "solver 'cholmod' is not built in: configure with "// &
                      '-DROCKDDA_WITH_CHOLMOD=ON, or choose another solver ('//solver_names//')')
#endif
   end subroutine new_cholmod

end module rockdda_linear_factory
