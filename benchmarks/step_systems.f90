! SPDX-License-Identifier: MIT
!> Systems K x = f taken from the steps of real runs, for tests and measurements of the solvers.
!>
!> The model is a wall of bricks 2 m x 1 m in running bond, upright or on an incline, its lowest course held by fixed
!> points. One course is a beam. The condition of K depends on the ratio of the contact stiffness to the inertia
!> of a brick, stiffness/(2 m/dt^2), which is an argument; E = stiffness/50.
module step_systems
   use rockdda_base_kinds, only : wp, pi
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_analysis_input, only : analysis_input_type, dialect
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_resolve, only : resolve_parameters
   use rockdda_linear_matrix, only : block_matrix_type, n_stored_blocks
   use rockdda_stepping_simulation, only : simulation_type
   implicit none
   private
   public :: wall_type, start_wall, write_matrix_market

   !> Dimensions, stiffness and options of a wall.
   type :: wall_type
      integer :: columns = 10           !! bricks in a course
      integer :: courses = 10
      real(wp) :: ratio = 1             !! contact stiffness over 2 m/dt^2
      real(wp) :: k01 = 1               !! 0 static, 1 dynamic
      real(wp) :: tilt = 0              !! the base rises towards +x [deg]
      real(wp) :: friction = 30         !! [deg]
      real(wp) :: bond = 0              !! cohesion and tensile strength of the joints [force/length]
      logical :: is_beam = .false.      !! only the first and the last brick of the lowest course are fixed
      character(len=8) :: solver = ''   !! blank: the default
      character(len=8) :: preconditioner = ''
      character(len=6) :: formulation = ''   !! of contacts; blank: the default
      real(wp) :: tolerance = 1.0e-10_wp
   end type wall_type

   real(wp), parameter :: length = 2, height = 1, density = 2500, dt = 0.01_wp

contains

   !> Prepare the run of a wall.
   subroutine start_wall(wall, sim, error)
      type(wall_type), intent(in) :: wall
      type(simulation_type), intent(inout) :: sim
      type(error_type), allocatable, intent(out) :: error
      type(block_system_type) :: blocks
      type(analysis_input_type) :: analysis
      type(run_options_type) :: options
      type(parameters_type) :: parameters
      type(diagnostics_type) :: messages
      integer :: n, i, column, course, n_fixed
      real(wp) :: x, y, turn(2, 2)

      n = wall%columns*wall%courses
      blocks%n_blocks = n
      allocate (blocks%vertex_offset(n + 1), blocks%vertices(2, 4*n), blocks%edge_joint(4*n), blocks%block_material(n))
      blocks%edge_joint = 1
      blocks%block_material = 1
      turn = reshape([cos(wall%tilt*pi/180), sin(wall%tilt*pi/180), -sin(wall%tilt*pi/180), cos(wall%tilt*pi/180)], &
                     [2, 2])
      n_fixed = merge(4, 2*wall%columns, wall%is_beam)
      blocks%fixed%n = n_fixed
      allocate (blocks%fixed%position(2, n_fixed), blocks%fixed%block(n_fixed), blocks%fixed%origin(n_fixed))
      n_fixed = 0
      do course = 1, wall%courses
         do column = 1, wall%columns
            i = column + (course - 1)*wall%columns
            x = length*(column - 1) + merge(length/2, 0.0_wp, mod(course, 2) == 0)
            y = height*(course - 1)
            blocks%vertex_offset(i + 1) = 4*i
            blocks%vertices(:, 4*i - 3:4*i) = matmul(turn, reshape( &
               [x, y, x + length, y, x + length, y + height, x, y + height], [2, 4]))
            if (course > 1) cycle
            if (wall%is_beam .and. column > 1 .and. column < wall%columns) cycle
            blocks%fixed%position(:, n_fixed + 1:n_fixed + 2) = blocks%vertices(:, 4*i - 3:4*i - 2)
            blocks%fixed%block(n_fixed + 1:n_fixed + 2) = i
            n_fixed = n_fixed + 2
         end do
      end do
      blocks%vertex_offset(1) = 0
      call no_points(blocks)

      analysis%dialect = dialect%g0
      analysis%n_steps = huge(1)
      analysis%dt_max = dt
      analysis%k01 = wall%k01
      analysis%displacement_ratio = 0.1_wp
      analysis%stiffness = wall%ratio*2*density*length*height/dt**2
      allocate (analysis%block_materials(1), analysis%joint_materials(1), analysis%fixed_tables(0), &
                analysis%loading_tables(0))
      analysis%block_materials(1)%density = density
      analysis%block_materials(1)%weight = density*9.81_wp
      analysis%block_materials(1)%youngs_modulus = analysis%stiffness/50
      analysis%block_materials(1)%poisson_ratio = 0.2_wp
      analysis%joint_materials(1)%friction_angle = wall%friction
      analysis%joint_materials(1)%cohesion = wall%bond
      analysis%joint_materials(1)%tension = wall%bond
      options%method = trim(wall%solver)
      options%preconditioner = trim(wall%preconditioner)
      options%tolerance = wall%tolerance
      options%formulation = trim(wall%formulation)
      call resolve_parameters(blocks, analysis, options, parameters, messages)
      call sim%init(blocks, parameters, error)
   end subroutine start_wall

   !> No loading or measured points, no bolts; fixed points without a prescribed motion.
   subroutine no_points(blocks)
      type(block_system_type), intent(inout) :: blocks
      allocate (blocks%loading%position(2, 0), blocks%loading%block(0), blocks%loading%origin(0))
      allocate (blocks%measured%position(2, 0), blocks%measured%block(0), blocks%measured%origin(0))
      allocate (blocks%bolts%ends(4, 0), blocks%bolts%blocks(2, 0), blocks%bolts%stiffness(0), &
                blocks%bolts%pretension(0), blocks%bolts%strength(0))
   end subroutine no_points

   !> Write K as a symmetric coordinate matrix and vectors as an array, one column each, in Matrix Market format.
   subroutine write_matrix_market(stem, matrix, columns)
      character(len=*), intent(in) :: stem                !! files stem.mtx and stem_vectors.mtx are replaced
      type(block_matrix_type), intent(in) :: matrix
      real(wp), intent(in) :: columns(:, :, :)            !! (6, n, vectors): load, solution, ...
      integer :: unit, i, k, r, c, v
      open (newunit=unit, file=stem//'.mtx', action='write', status='replace')
      write (unit, '(a)') '%%MatrixMarket matrix coordinate real symmetric'
      write (unit, '(i0, 1x, i0, 1x, i0)') 6*matrix%n, 6*matrix%n, 36*n_stored_blocks(matrix) - 15*matrix%n
      do i = 1, matrix%n
         do k = matrix%row_start(i), matrix%row_start(i + 1) - 1
            do c = 1, 6
               do r = 1, 6
                  ! the lower triangle: K_ij of the upper half, transposed
                  if (matrix%column(k) == i .and. r > c) cycle
                  write (unit, '(i0, 1x, i0, 1x, es24.16)') 6*(matrix%column(k) - 1) + c, 6*(i - 1) + r, &
                     matrix%values(r, c, k)
               end do
            end do
         end do
      end do
      close (unit)
      open (newunit=unit, file=stem//'_vectors.mtx', action='write', status='replace')
      write (unit, '(a)') '%%MatrixMarket matrix array real general'
      write (unit, '(i0, 1x, i0)') 6*matrix%n, size(columns, 3)
      do v = 1, size(columns, 3)
         do i = 1, matrix%n
            write (unit, '(es24.16)') columns(:, i, v)
         end do
      end do
      close (unit)
   end subroutine write_matrix_market

end module step_systems
